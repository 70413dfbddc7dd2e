"""Compiled code on disk: whatever is found there, the function computes what it says."""

import ctypes
import errno
import gc
import hashlib
import importlib
import os
import pickle
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from camcomp.ground import compiled, linked_code, machine_code, native_code, notes
from camcomp.ground.compiled import entry
from tests.commandline import ROOT


def twice(x):
    return x + x


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "code"))
    monkeypatch.setattr(notes, "_told", set())
    return tmp_path / "code"


def fresh():
    """As a new process would make it: what the function gives, and whether its code came from the disk."""
    made = machine_code.Cached(twice)
    return call(made, 21), made.hits


def call(made, *args):
    return made.load(native_code.describe(args), args)(None, args, None)


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
    made = machine_code.Cached(twice)
    call(made, 21)
    (whole_numbers,) = files(folder)
    call(made, 1.5)
    (fraction,) = set(files(folder)) - {whole_numbers}
    shutil.copy(fraction, whole_numbers)
    assert fresh() == (42, 0)


def test_code_of_other_sources_goes(folder):
    fresh()
    made = machine_code.Cached(twice)
    made.files._source_stamp = "another"
    call(made, 21)
    assert len(files(folder)) == 1 and fresh() == (42, 0)


def test_without_a_place_it_is_compiled_in_memory_with_one_note(folder, capsys, monkeypatch):
    folder.write_bytes(b"no folder")
    monkeypatch.setattr(machine_code, "_folders", lambda file: [folder / "code"])
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
    assert machine_code._user_cache() is None


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="asks for POSIX owners")
class TestCodeOfOthers:
    """A file of code is executed: what others can put there is not opened."""

    @pytest.mark.parametrize("mode", [0o777, 0o733])
    def test_a_folder_that_others_can_write_to_is_not_used(self, folder, capsys, mode):
        folder.mkdir(mode=0o700)
        folder.chmod(mode)
        assert fresh()[0] == 42 and files(folder) == []
        assert "can be written by every user, and code from there would be executed" in capsys.readouterr().err

    def test_a_folder_below_one_that_others_can_write_to_is_not_used(self, folder, capsys):
        fresh()
        folder.chmod(0o777)
        assert machine_code.find_folder(Path(__file__)).parent != folder
        folder.chmod(0o1777)  # as /tmp: nobody moves what others own
        assert machine_code.find_folder(Path(__file__)).parent == folder

    @pytest.mark.parametrize("mode", [0o666, 0o602])
    def test_a_file_that_others_can_write_is_not_opened(self, folder, capsys, mode):
        fresh()
        (path,) = files(folder)
        path.write_bytes(poisoned(path.read_bytes(), folder / "executed"))
        path.chmod(mode)
        assert fresh() == (42, 0) and not (folder / "executed").exists()
        assert "can be written by every user" in capsys.readouterr().err
        assert stat.S_IMODE(path.stat().st_mode) == 0o600 and fresh() == (42, 1)

    @pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="gives files away")
    @pytest.mark.parametrize("what", ["file", "folder"])
    def test_what_another_user_owns_is_not_opened(self, folder, capsys, what):
        fresh()
        (path,) = files(folder)
        path.write_bytes(poisoned(path.read_bytes(), folder / "executed"))
        os.chown(path if what == "file" else path.parent, 12345, 12345)
        fresh()
        assert not (folder / "executed").exists()
        assert "belongs to another user" in capsys.readouterr().err

    def test_a_pipe_in_the_place_of_a_file_is_not_waited_for(self, folder):
        fresh()
        (path,) = files(folder)
        path.unlink()
        os.mkfifo(path)
        assert fresh() == (42, 0)

    def test_settings_of_the_current_folder_name_no_folder_for_code(self, tmp_path, monkeypatch):
        monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
        (tmp_path / ".numba_config.yaml").write_text("cache_dir: evil\n")
        code = (
            "import pathlib; from camcomp.ground import machine_code as m; "
            f"print(*m._folders(pathlib.Path({__file__!r})))"
        )
        done = subprocess.run(
            [sys.executable, "-c", code],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            check=True,
        )
        assert "evil" not in done.stdout and "__pycache__" in done.stdout


class Executed:
    def __init__(self, mark):
        self.mark = str(mark)

    def __reduce__(self):
        return open, (self.mark, "w")


def poisoned(data, mark):
    """A file of code as another user would leave it, its checksum right."""
    text = pickle.dumps(Executed(mark))
    return hashlib.sha256(text).digest() + text


@pytest.mark.parametrize("missing", ["_reload_init", "_final_module", "no library", "CompilerBase"])
def test_a_numba_of_another_build_compiles_as_usual(folder, monkeypatch, missing):
    """The private parts that are used are not there, or are otherwise: numba itself is right all the same."""
    from numba.core import codegen, compiler

    for each in (linked_code.is_usable, linked_code._part_class, linked_code.linking_options):
        each.cache_clear()
    if missing == "no library":
        monkeypatch.delattr(codegen, "JITCodeLibrary")
    elif hasattr(compiler, missing):
        monkeypatch.delattr(compiler, missing)
    else:
        monkeypatch.setattr(linked_code, "_part_class", lambda: broken(codegen.JITCodeLibrary, missing))
    try:
        assert not linked_code.linking_options() or not linked_code.is_usable()
        made = linked_code.inner(twice)
        assert entry(lambda x: made(x) + 1.0)(20.0) == 41.0
    finally:
        for each in (linked_code.is_usable, linked_code._part_class, linked_code.linking_options, linked_code.inner):
            if hasattr(each, "cache_clear"):
                each.cache_clear()


@pytest.mark.parametrize("missing", ["_nrt", "no_cfunc_wrapper"])
def test_a_numba_without_an_option_that_saves_time_compiles_as_usual(folder, monkeypatch, missing):
    plain = linked_code.numba.njit

    def njit(**options):
        if missing in options:
            raise KeyError(f"Unrecognized options: {missing}")
        return plain(**options)

    linked_code.inner.cache_clear()
    monkeypatch.setattr(linked_code.numba, "njit", njit)
    made = linked_code.inner(twice)
    assert entry(lambda x: made(x) + 1.0)(20.0) == 41.0


def test_a_numba_without_the_names_of_its_dispatcher_compiles_as_usual(folder, monkeypatch):
    class Dispatcher:
        def __call__(self, x):
            return twice(x)

    monkeypatch.setattr(linked_code, "dispatcher", lambda function, allocates: Dispatcher())
    assert entry(twice)(20.0) == 40.0


def test_direct_calls_give_the_same(folder):
    made = entry(twice)
    assert compiled.direct(made, (20.0,))(20.0) == 40.0 == made(20.0)


def broken(library, name):
    class Broken(library):
        def finalize(self):
            raise AttributeError(name)

    return Broken


@pytest.mark.parametrize("lacks", ["object files", "helpers"])
def test_a_numba_whose_results_cannot_be_kept_compiles_every_time(folder, monkeypatch, lacks):
    from numba.core.codegen import CPUCodeLibrary

    if lacks == "object files":
        monkeypatch.delattr(CPUCodeLibrary, "serialize_using_object_code")
    else:
        assert fresh() == (42, 0)
        monkeypatch.setattr(native_code, "_link", lambda: importlib.import_module("numba._no_such_module"))
    assert fresh() == (42, 0) == fresh()


def test_code_linked_twice_outlives_either(folder):
    assert fresh() == (42, 0)
    first, second = (machine_code.Cached(twice).load(native_code.describe((21,)), (21,)) for _ in range(2))
    (data,) = (each.read_bytes() for each in files(folder))
    code = native_code.ObjectCode(*pickle.loads(data[hashlib.sha256().digest_size :])[1])
    del second
    gc.collect()
    place = native_code._engine().get_global_value_address(code.environment)
    pointed = ctypes.c_void_p.from_address(place).value
    assert pointed in map(id, native_code._ENVIRONMENTS)
    assert first(None, (21,), None) == 42


def test_code_from_the_disk_needs_no_numba(folder):
    code = (
        "import sys; import numpy as np; from camcomp.compensation.long.kernel import follow; out = np.zeros((1, 3)); "
        "follow(2.0 * np.eye(3)[None], np.array([0]), np.ones((1, 3)), out); print(out[0], 'numba' in sys.modules)"
    )
    said = [
        subprocess.check_output([sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": str(ROOT)}, text=True)
        for _ in range(2)
    ]
    assert said == ["[2. 2. 2.] True\n", "[2. 2. 2.] False\n"]


class TestTypesOfArguments:
    """Code for one kind of array is wrong for every other one."""

    @pytest.mark.parametrize(
        "other",
        [
            np.zeros((2, 3), np.float32), np.zeros((2, 3), np.int64), np.zeros(6), np.zeros((2, 3)).T, np.zeros((2, 6))[:, ::2],
            np.broadcast_to(0.0, (2, 3)), 0.0, (np.zeros((2, 3)),),
        ],
        ids=["narrow", "whole numbers", "one dimension", "columns first", "steps", "read-only", "a number", "a tuple"],
    )  # fmt: skip
    def test_another_kind_is_told_apart(self, other):
        def described(value):
            try:
                return native_code.describe((value,))
            except TypeError:
                return None  # numba's business

        assert described(np.zeros((2, 3))) != described(other)

    def test_a_number_counts_as_numba_takes_it(self):
        values = (True, 1, 1.0, np.float64(1.0), np.int64(1), np.bool_(True))
        numbers = ("|b1", "<i8", "<f8", "<f8", "<i8", "|b1")
        assert native_code.describe(values) == numbers

    def test_kinds_that_only_numba_knows_are_left_to_it(self, folder):
        assert entry(twice)(1j) == 2j and entry(twice)(np.float32(1.5)) == 3.0


def test_code_with_addresses_of_this_process_is_not_kept(folder, capsys):
    big = np.arange(1 << 21, dtype=float)  # numba takes large arrays in by their address

    def first(x):
        return big[0] + x

    assert entry(first)(42.0) == 42.0
    assert files(folder) == [] and "addresses" in capsys.readouterr().err


def test_notes_of_workers_wait_for_their_parent(monkeypatch, capsys):
    monkeypatch.setattr(notes, "_told", set())
    monkeypatch.setattr(notes, "_held", None)
    notes.hold()
    notes.note("topic", "text")
    notes.note("topic", "other text")
    assert notes.held() == {"topic": "text"} and notes.held() == {}
    assert capsys.readouterr().err == ""
