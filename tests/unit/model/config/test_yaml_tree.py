import time

import pytest

from camcomp.model.config.yaml_text import read_tree
from camcomp.model.config.yaml_tree import find, leaves, merge, plain
from tests.pace import soon


def values(text):
    tree, errors = read_tree(text.encode(), "a.yaml")
    assert not errors
    return plain(tree)


def errors(text):
    data = text if isinstance(text, bytes) else text.encode()
    return [(each.rule, each.at.line, each.at.column) for each in read_tree(data, "a.yaml")[1]]


def test_scalars_follow_yaml_1_2():
    text = (
        "a: 1e6\nb: 2e-3\nc: 012\nd: 0x1F\ne: 0o17\nf: yes\ng: 1:30\nh: True\ni: ~\nj:\nk: '3'\nl: +.5\nm: 2026-01-01\n"
        "n: -12\no: 1.\n"
    )
    assert values(text) == {
        "a": 1e6, "b": 2e-3, "c": 12, "d": 31, "e": 15, "f": "yes", "g": "1:30", "h": True, "i": None, "j": None,
        "k": "3", "l": 0.5, "m": "2026-01-01", "n": -12, "o": 1.0,
    }  # fmt: skip


def test_nan_and_infinity_are_floats_for_the_spec_to_refuse():
    assert [str(each) for each in values("[.nan, .inf, -.INF]")] == ["nan", "inf", "-inf"]


def test_anchors_and_merge_keys():
    text = "a: &a {x: 1, y: 2}\nb: {<<: *a, y: 3}\nc: {<<: [{y: 4}, *a]}\nd: {'<<': 1}\n"
    assert values(text) == {
        "a": {"x": 1, "y": 2}, "b": {"x": 1, "y": 3}, "c": {"x": 1, "y": 4}, "d": {"<<": 1},
    }  # fmt: skip


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a: [1,\n", ("CC200", 2, 1)),
        ("a: b: c\n", ("CC200", 1, 5)),
        ("a: *b\n", ("CC200", 1, 4)),
        ("a: 1\n---\nb: 1\n", ("CC200", 2, 1)),
        ("a:\n\tb: 1\n", ("CC210", 2, 1)),
        ("a:\n  b: 1\n\tc: 2\n", ("CC210", 3, 1)),
        ("", ("CC211", 1, 1)),
        ("# only a comment\n", ("CC211", 1, 1)),
        ("a: 1\nb:\n  c: 1\n  c: 2\n", ("CC207", 4, 3)),
        ("a: !!python/object 1\n", ("CC200", 1, 4)),
        ("[1, 2]: 3\n", ("CC200", 1, 1)),
        ("a: &a [*a]\n", ("CC200", 1, 4)),
        ("a: {<<: 3}\n", ("CC204", 1, 9)),
        (b"a: 1\nb: \xff\n", ("CC200", 2, 4)),
        ("a: 1\nb: \x07\n", ("CC200", 2, 4)),
        ("[" * 5000, ("CC217", 1, 51)),
    ],
)
def test_what_is_no_clean_yaml_has_its_place(text, expected):
    assert errors(text) == [expected]


def test_every_duplicate_key_is_reported():
    assert errors("a: 1\na: 2\nb: {c: 1, c: 2}\n") == [("CC207", 2, 1), ("CC207", 3, 11)]


def test_positions_of_keys_and_values():
    tree, _ = read_tree(b"\xef\xbb\xbfa:\n  - b: 1\n    c: 2\n", "a.yaml")
    node = find(tree, ("a", 0, "c"))
    assert (node.key_at.line, node.key_at.column) == (3, 5)
    assert (node.at.line, node.at.column, node.at.source) == (3, 8, "    c: 2")
    assert find(tree, ("a", "tag", 0, "zzz")).at.line == 2


def test_a_byte_order_mark_shifts_nothing():
    tree, _ = read_tree(b"\xef\xbb\xbfa: 1\n", "a.yaml")
    assert find(tree, ("a",)).at.column == 4
    assert find(tree, ("a",)).at.source == "a: 1"


def test_a_missing_value_stands_where_its_key_is():
    tree, _ = read_tree(b"a:\n\n\nb: 1\n", "a.yaml")
    assert find(tree, ("a",)).at.line == 1


def tree_of(text):
    return read_tree(text.encode(), "a.yaml")[0]


@pytest.mark.parametrize(
    ("base", "over", "expected"),
    [
        ("{a: 1, b: {c: 2, d: 3}}", "{b: {d: 4, e: 5}}", {"a": 1, "b": {"c": 2, "d": 4, "e": 5}}),
        ("{a: [1, 2]}", "{a: [3]}", {"a": [3]}),
        ("{a: {b: 1}}", "{a: 2}", {"a": 2}),
        ("{f: {model: constant, Fr_N: 1}}", "{f: {model: none}}", {"f": {"model": "none"}}),
        ("{f: {model: constant, Fr_N: 1}}", "{f: {model: constant, Ft_N: 2}}",
         {"f": {"model": "constant", "Fr_N": 1, "Ft_N": 2}}),
        ("{f: {model: constant, Fr_N: 1}}", "{f: {Fr_N: 2}}", {"f": {"model": "constant", "Fr_N": 2}}),
    ],
)  # fmt: skip
def test_merging(base, over, expected):
    assert plain(merge(tree_of(base), tree_of(over))) == expected


def test_paths_are_relative_to_their_own_file():
    tree, _ = read_tree(b"force: {model: table, file: f.csv, zero_file: /a/b.csv, profile: p}", "some/dir/a.yaml")
    assert plain(tree)["force"] == {
        "model": "table", "file": "some/dir/f.csv", "zero_file": "/a/b.csv", "profile": "p",
    }  # fmt: skip


def test_leaves_have_dotted_names():
    named = {name: plain(node) for name, node in leaves(tree_of("{a: {b: [{c: 1}, {c: [2, 3]}]}, d: []}"))}
    assert named == {"a.b[1].c": 1, "a.b[2].c": [2, 3], "d": []}


BOMB = "a: &a [1,1,1,1,1,1,1,1,1,1]\n" + "".join(
    f"{name}: &{name} [{','.join(['*' + before] * 10)}]\n" for before, name in zip("abcdefgh", "bcdefghi", strict=True)
)
MERGES = "a0: &a0 {x: 1}\n" + "".join(
    f"a{i}: &a{i} {{<<: *a{i - 1}, b: *a{i - 1}, c: *a{i - 1}}}\n" for i in range(1, 40)
)


@pytest.mark.parametrize(
    "text",
    [BOMB, MERGES, "[" + "1," * 30_000 + "1]", "[" * 5000, "{a: " * 3000, "- " * 5000, "? " * 5000, "# x\n" * 300_000],
    ids=["aliases", "merges", "values", "lists", "maps", "items", "keys", "bytes"],
)
def test_budgets_end_what_no_machine_file_needs(text):
    begun = time.process_time()
    tree, errors = read_tree(text.encode(), "file.yaml")
    assert tree is None and [each.rule for each in errors] == ["CC217"] and errors[0].at.line >= 1
    assert soon(time.process_time() - begun, 2.0)


@pytest.mark.parametrize("number", ["1e308", "-1e19", "9" * 300, "0x" + "f" * 99])
def test_numbers_have_bounds(number):
    errors = read_tree(f"robot:\n  length_mm: {number}\n".encode(), "file.yaml")[1]
    assert [(each.rule, each.at.line) for each in errors] == [("CC205", 2)]


@pytest.mark.parametrize("text", ["\\0", "\\ud800"])
def test_text_that_no_file_name_may_hold(text):
    assert [each.rule for each in read_tree(f'file: "{text}"\n'.encode(), "file.yaml")[1]] == ["CC200"]


def test_an_anchor_may_be_used_again():
    assert read_tree(b"a: &x 1\nb: &x 2\nc: *x\n", "file.yaml")[1] == []
