"""Compiled code on disk: whatever is found there, the function computes what it says."""

import errno
import os
import pickle
import shutil

import numba
import pytest

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
