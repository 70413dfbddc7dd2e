"""Compiled code on disk: whatever is found there, the function computes what it says."""

import errno
import os
import pickle
import shutil

import numba
import pytest
from numba.core import event

from camcomp.ground import machine_code, notes


def twice(x):
    return x + x


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "code"))
    monkeypatch.setattr(notes, "_told", set())
    return tmp_path / "code"


def fresh():
    """As a new process would make it: (dispatcher, what it gives, whether the code came from the disk)."""
    made = machine_code.kept(twice)
    value = made(21)
    return value, sum(made.stats.cache_hits.values())


def files(folder):
    return sorted(folder.rglob("*.nbc"))


def test_code_is_kept(folder, capsys):
    assert fresh() == (42, 0)
    assert fresh() == (42, 1) and len(files(folder)) == 1
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: b"",
        lambda data: data[:100],
        lambda data: data[:-1],
        lambda data: os.urandom(len(data)),
        lambda data: data[:2000] + bytes([data[2000] ^ 1]) + data[2001:],
        lambda data: pickle.dumps("an object of another program"),
    ],
)
def test_damaged_code_is_compiled_anew_and_repaired_with_one_note(folder, capsys, damage):
    fresh()
    (path,) = files(folder)
    path.write_bytes(damage(path.read_bytes()))
    assert fresh() == (42, 0)
    assert fresh() == (42, 1)
    assert capsys.readouterr().err.count("note:") == 1


def test_a_folder_in_the_place_of_a_file_is_survived(folder, capsys):
    fresh()
    (path,) = files(folder)
    path.unlink()
    path.mkdir()
    assert fresh() == (42, 0) == fresh()
    assert capsys.readouterr().err.count("note:") == 1


def test_code_under_the_name_of_other_code_is_not_taken(folder):
    made = machine_code.kept(twice)
    made(21)
    (whole_numbers,) = files(folder)
    made(1.5)
    (fraction,) = set(files(folder)) - {whole_numbers}
    shutil.copy(fraction, whole_numbers)
    assert fresh() == (42, 0)


def test_code_of_other_sources_goes(folder):
    fresh()
    made = machine_code.kept(twice)
    made._cache._cache_file._source_stamp = "another"
    made(21)
    assert len(files(folder)) == 1 and fresh() == (42, 0)


def test_without_a_place_it_is_compiled_in_memory_with_one_note(folder, capsys, monkeypatch):
    folder.write_bytes(b"no folder")
    monkeypatch.setattr(machine_code._Place, "_locator_classes", [machine_code._caching.UserProvidedCacheLocator])
    assert fresh() == fresh() == (42, 0)
    assert capsys.readouterr().err.count("note:") == 1


def test_a_full_disk_is_no_error(folder, capsys, monkeypatch):
    def full(handle):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    assert fresh() == fresh() == (42, 0)
    said = capsys.readouterr().err
    assert said.count("note:") == 1 and "No space left on device" in said
    assert [each for each in folder.rglob("*") if each.is_file()] == []


@pytest.fixture
def along(folder, tmp_path, monkeypatch):
    """Code of `twice` that an installation brings along, and no code of the user's."""
    place = tmp_path / "along"
    place.mkdir()
    monkeypatch.setattr(machine_code._Bringing, "folder", place)
    assert machine_code.kept(twice, digest="sources")(21) == 42
    monkeypatch.setattr(machine_code._Bringing, "folder", None)
    monkeypatch.setattr(machine_code, "BROUGHT_ALONG", place)
    shutil.rmtree(folder)
    (path,) = files(place)
    return path


def compiled_for(value, digest):
    """(What `twice` of a value is, how often numba had to compile for it)."""
    with event.install_recorder("numba:compile") as compiled:
        made = machine_code.kept(twice, digest=digest)(value)
    return made, sum(each.is_start for _, each in compiled.buffer)


def test_code_that_was_brought_along_is_not_compiled_and_then_the_users_own(along, folder, capsys):
    assert compiled_for(21, "sources") == (42, 0)
    assert len(files(folder)) == 1
    along.unlink()
    assert compiled_for(21, "sources") == (42, 0)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(("value", "digest"), [(1.5, "sources"), (21, "other sources"), (21, None)])
def test_code_that_was_brought_along_for_something_else_is_not_taken(along, value, digest):
    assert compiled_for(value, digest) == (2 * value, 1)


def test_code_for_another_kind_of_machine_is_not_taken(along, monkeypatch):
    key = machine_code._Cache._linked_key
    monkeypatch.setattr(machine_code._Cache, "_linked_key", lambda *args: (*key(*args)[:1], "z80", *key(*args)[2:]))
    assert compiled_for(21, "sources") == (42, 1)


def test_damaged_code_that_was_brought_along_is_one_note(along, folder, capsys):
    along.write_bytes(along.read_bytes()[:-1])
    assert compiled_for(21, "sources") == (42, 1)
    assert capsys.readouterr().err.count("note:") == 1
    assert compiled_for(21, "sources") == (42, 0)


def test_who_has_no_home_gets_no_folder_called_tilde(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(os.path, "expanduser", lambda path: path)
    monkeypatch.setattr(machine_code._Place, "_locator_classes", [machine_code._UserWide])
    monkeypatch.setattr(notes, "_told", set())
    assert fresh() == (42, 0)
    assert list(tmp_path.iterdir()) == []


def test_notes_of_workers_wait_for_their_parent(monkeypatch, capsys):
    monkeypatch.setattr(notes, "_told", set())
    monkeypatch.setattr(notes, "_held", None)
    notes.hold()
    notes.note("topic", "text")
    notes.note("topic", "other text")
    assert notes.held() == {"topic": "text"} and notes.held() == {}
    assert capsys.readouterr().err == ""
