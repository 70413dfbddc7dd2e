import pytest

from camcomp.ground import errors as d

AT = d.Location("a.yaml", 3, 4, "\tab: 2")


def test_format_has_place_rule_source_caret_and_hint():
    error = d.ConfigError("CC201", "unknown key 'b'", at=AT, hint="did you mean 'c'?")
    assert d.format_error(error) == (
        "a.yaml:3:4: error[CC201]: unknown key 'b'\n  \tab: 2\n  \t  ^\n  hint: did you mean 'c'?"
    )


def test_without_a_place_or_source_only_the_message_is_shown():
    more = "\n  hint: `camcomp explain CC201` says more"
    assert d.format_error(d.ConfigError("CC201", "text")) == "camcomp: error[CC201]: text" + more
    bare = d.ConfigError("CC201", "text", at=d.Location("a", 1, 1))
    assert d.format_error(bare) == "a:1:1: error[CC201]: text" + more


def test_color_changes_nothing_but_escapes():
    import re

    error = d.ConfigError("CC207", "text", at=AT)
    colored = d.format_error(error, color=True)
    assert "\033[" in colored
    assert re.sub(r"\033\[[0-9;]*m", "", colored) == d.format_error(error)


def test_the_rule_gives_the_hint_when_the_error_has_none():
    assert d.ConfigError("CC207", "text").hint == "delete one of the two"


def test_errors_travel_together_in_order():
    first, second, third = (d.ConfigError("CC201", str(i)) for i in range(3))
    with pytest.raises(d.ConfigError) as caught:
        d.raise_all([first, second, third])
    assert [each.message for each in caught.value.all()] == ["0", "1", "2"]
    assert d.format_error(caught.value).count("error[CC201]") == 3
    d.raise_all([])


@pytest.mark.parametrize(
    ("family", "code"),
    [(d.CheckFailed, 1), (d.ConfigError, 2), (d.ProgramError, 3), (d.PhysicsError, 4), (d.FileError, 5)],
)
def test_exit_codes(family, code):
    assert family("CC500", "text").exit_code == code
