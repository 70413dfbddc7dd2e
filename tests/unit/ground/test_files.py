import os
import stat
import sys

import pytest

from camcomp.ground import files
from camcomp.ground.errors import FileError


def test_a_missing_file_is_an_error_of_its_own(tmp_path):
    with pytest.raises(FileError) as caught:
        files.read_bytes(tmp_path / "no")
    assert (caught.value.rule, caught.value.exit_code) == ("CC500", 5)


def test_a_folder_or_a_mistyped_name_gets_a_hint_of_its_own(tmp_path):
    (tmp_path / "groove.nc").write_bytes(b"")
    with pytest.raises(FileError) as folder:
        files.read_bytes(tmp_path)
    with pytest.raises(FileError) as mistyped:
        files.open_source(tmp_path / "grove.nc")
    with pytest.raises(FileError) as strange:
        files.read_bytes(tmp_path / "experiment.yaml")
    assert "folder" in folder.value.hint
    assert mistyped.value.hint == f"did you mean {tmp_path / 'groove.nc'}?"
    assert strange.value.hint == "check the path"


def test_write_all_writes_and_leaves_nothing_else(tmp_path):
    files.write_all({tmp_path / "a": b"1", tmp_path / "b": b"2"})
    assert {each.name: each.read_bytes() for each in tmp_path.iterdir()} == {"a": b"1", "b": b"2"}


def test_all_or_none(tmp_path):
    (tmp_path / "a").write_bytes(b"old")
    with pytest.raises(FileError) as caught:
        files.write_all({tmp_path / "a": b"new", tmp_path / "no" / "b": b"2"})
    assert caught.value.rule == "CC501"
    assert str(tmp_path / "no" / "b") in caught.value.message
    assert {each.name: each.read_bytes() for each in tmp_path.iterdir()} == {"a": b"old"}


def test_a_folder_is_no_output(tmp_path):
    (tmp_path / "d").mkdir()
    with pytest.raises(FileError):
        files.write_all({tmp_path / "a": b"1", tmp_path / "d": b"2"})
    assert not (tmp_path / "a").exists()


def test_permissions_are_kept_and_new_files_follow_the_umask(tmp_path):
    old = tmp_path / "old"
    old.write_bytes(b"")
    old.chmod(0o640)
    before = os.umask(0o027)
    try:
        files.write_all({old: b"1", tmp_path / "new": b"2"})
    finally:
        os.umask(before)
    assert stat.S_IMODE(old.stat().st_mode) == 0o640
    assert stat.S_IMODE((tmp_path / "new").stat().st_mode) == 0o640


@pytest.mark.parametrize("kind", ["same", "dots", "symlink", "hard link"])
def test_the_input_is_never_overwritten(tmp_path, kind):
    source = tmp_path / "in.nc"
    source.write_bytes(b"G1")
    output = {
        "same": source, "dots": tmp_path / "x" / ".." / "in.nc", "symlink": tmp_path / "s", "hard link": tmp_path / "h",
    }[kind]  # fmt: skip
    (tmp_path / "x").mkdir()
    (tmp_path / "s").symlink_to(source)
    (tmp_path / "h").hardlink_to(source)
    with pytest.raises(FileError) as caught:
        files.write_all({output: b"gone"}, inputs=(source,))
    assert caught.value.rule == "CC502"
    assert source.read_bytes() == b"G1"


def test_two_outputs_need_two_names(tmp_path):
    with pytest.raises(FileError) as caught:
        files.write_all({tmp_path / "a": b"1", tmp_path / "x" / ".." / "a": b"2"})
    assert caught.value.rule == "CC502"


def test_a_link_is_followed(tmp_path):
    (tmp_path / "real").write_bytes(b"old")
    (tmp_path / "link").symlink_to("real")
    files.write_all({tmp_path / "link": b"new"})
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_bytes() == b"new"


def test_dash_is_standard_output_after_the_files(tmp_path, capfdbinary):
    files.write_all({"-": b"data\n", tmp_path / "a": b"1"})
    assert capfdbinary.readouterr().out == b"data\n"
    with pytest.raises(FileError):
        files.write_all({"-": b"data\n", tmp_path / "no" / "a": b"1"})
    assert capfdbinary.readouterr().out == b""


def test_dash_is_standard_input(monkeypatch):
    class Stdin:
        import io

        buffer = io.BytesIO(b"G1")

    monkeypatch.setattr(sys, "stdin", Stdin)
    assert files.read_bytes("-") == b"G1"


def test_shipped_finds_the_samples_and_says_when_it_does_not():
    assert files.shipped("config/orthoglide.yaml").read_bytes().startswith(b"# yaml-language-server")
    with pytest.raises(FileError):
        files.shipped("config/no-such.yaml")
