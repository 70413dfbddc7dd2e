import errno
import os
import resource
import signal
import socket
import stat
import sys
import threading

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


# --- what is no regular file ------------------------------------------------------------------------------------------


def test_a_pipe_is_written_to_and_stays_one(tmp_path):
    pipe, got = tmp_path / "pipe", []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: got.append(pipe.read_bytes()))
    reader.start()
    files.write_all({pipe: b"data", tmp_path / "a": b"1"})
    reader.join()
    assert got == [b"data"] and stat.S_ISFIFO(pipe.stat().st_mode)
    assert sorted(each.name for each in tmp_path.iterdir()) == ["a", "pipe"]


def test_a_character_device_is_written_to_and_stays_one(tmp_path):
    master, slave = os.openpty()
    link = tmp_path / "link"
    link.symlink_to(os.ttyname(slave))
    try:
        files.write_all({link: b"data"})
        assert os.read(master, 9) == b"data" and stat.S_ISCHR(os.stat(os.ttyname(slave)).st_mode)
    finally:
        os.close(master)
        os.close(slave)


def test_a_device_made_here_is_not_replaced(tmp_path):
    device = tmp_path / "null"
    try:
        os.mknod(device, stat.S_IFCHR | 0o666, os.makedev(1, 3))
        files.write_all({device: b"data"})
    except PermissionError:
        pytest.skip("only root makes devices, and not everywhere")
    assert stat.S_ISCHR(device.stat().st_mode)


def test_a_socket_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_UNIX) as server:
        server.bind("socket")
        with pytest.raises(FileError, match="it is a socket"):
            files.write_all({"socket": b"data", "a": b"1"})
        assert stat.S_ISSOCK(os.stat("socket").st_mode) and not os.path.exists("a")


def test_the_name_of_a_descriptor_writes_into_what_it_stands_for(tmp_path):
    """A log that standard output was appended to keeps what stood in it."""
    log = tmp_path / "log"
    log.write_bytes(b"old ")
    with log.open("ab") as opened:
        files.write_all({f"/dev/fd/{opened.fileno()}": b"new"})
    assert log.read_bytes() == b"old new"


# --- one place each ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["same", "dots", "symlink", "folder link", "hard link", "capitals", "dash twice"])
def test_two_outputs_are_two_files_under_whatever_names(tmp_path, kind):
    (tmp_path / "d").mkdir()
    a = tmp_path / "d" / "a"
    a.write_bytes(b"old")
    (tmp_path / "s").symlink_to(a)
    (tmp_path / "e").symlink_to("d")
    (tmp_path / "h").hardlink_to(a)
    other = {
        "same": a, "dots": tmp_path / "d" / ".." / "d" / "a", "symlink": tmp_path / "s", "folder link": tmp_path / "e" / "a",
        "hard link": tmp_path / "h", "capitals": tmp_path / "d" / "A", "dash twice": "-",
    }[kind]  # fmt: skip
    first = "-" if kind == "dash twice" else str(a)
    with pytest.raises(FileError) as caught, files.writing([first, str(other)]):
        pass
    assert caught.value.rule == "CC502" and a.read_bytes() == b"old"


def test_two_links_to_nothing_yet_are_one_file(tmp_path):
    (tmp_path / "s").symlink_to("new")
    with pytest.raises(FileError, match="same file"):
        files.write_all({tmp_path / "s": b"1", tmp_path / "new": b"2"})


def test_what_a_command_has_read_is_an_input_whoever_read_it(tmp_path):
    """A table that a config names, a log of an experiment: the verbs do not list them."""
    table = tmp_path / "table.csv"
    table.write_bytes(b"1")
    with files.remembering_inputs():
        files.read_bytes(table)
        with pytest.raises(FileError, match="is an input"):
            files.write_all({tmp_path / "x" / ".." / "table.csv": b"gone"})
    files.write_all({table: b"now"})


def test_a_pipe_is_read_once_and_gives_the_same_again(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    writer = threading.Thread(target=lambda: (tmp_path / "pipe").write_bytes(b"G1"))
    writer.start()
    with files.remembering_inputs():
        assert [files.read_bytes(tmp_path / "pipe") for _ in range(2)] == [b"G1", b"G1"]
    writer.join()


# --- what goes wrong while writing --------------------------------------------------------------------------------------


@pytest.fixture(params=[True, False], ids=["nameless", "beside"])
def nameless(request, monkeypatch):
    """Both ways to make a file that is invisible until it is whole."""
    if not request.param:
        monkeypatch.delattr(os, "O_TMPFILE", raising=False)
    return request.param


def test_files_are_whole_and_nothing_else_is_left(tmp_path, nameless):
    (tmp_path / "a").write_bytes(b"old")
    files.write_all({tmp_path / "a": b"1", tmp_path / "b": b"2"})
    assert {each.name: each.read_bytes() for each in tmp_path.iterdir()} == {"a": b"1", "b": b"2"}


def test_a_full_disk_names_the_file(tmp_path, nameless):
    (tmp_path / "a").write_bytes(b"old")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
    try:
        with pytest.raises(FileError) as caught:
            files.write_all({tmp_path / "b": b"2", tmp_path / "a": b"1" * 100_000})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)
    assert caught.value.rule == "CC501" and str(tmp_path / "a") in caught.value.message
    assert {each.name: each.read_bytes() for each in tmp_path.iterdir()} == {"a": b"old"}


@pytest.mark.parametrize("step", ["fsync", "replace", "link", "fchmod"])
def test_an_error_at_any_step_names_the_file_and_leaves_nothing(tmp_path, nameless, monkeypatch, step):
    (tmp_path / "a").write_bytes(b"old")

    def full(*_, **__):
        raise OSError(errno.ENOSPC, "No space left on device")

    if step == "link" and not nameless:
        pytest.skip("no links are made")
    monkeypatch.setattr(os, step, full)
    with pytest.raises(FileError, match="cannot write .*/a: No space left"):
        files.write_all({tmp_path / "a": b"new"})
    monkeypatch.undo()
    assert {each.name: each.read_bytes() for each in tmp_path.iterdir()} == {"a": b"old"}


def test_files_and_folders_are_on_the_disk_before_it_is_said(tmp_path, nameless, monkeypatch):
    steps, sync, rename, link = [], os.fsync, os.replace, os.link

    def synced(handle):
        steps.append("folder" if stat.S_ISDIR(os.fstat(handle).st_mode) else "file")
        sync(handle)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(os, "replace", lambda *words: (steps.append("named"), rename(*words)))
    monkeypatch.setattr(os, "link", lambda *words, **more: (steps.append("named"), link(*words, **more)))
    files.write_all({tmp_path / "a": b"1"})
    assert steps == ["file", "named", "folder"]


def test_a_process_that_is_killed_in_the_middle_leaves_nothing(tmp_path):
    if not hasattr(os, "O_TMPFILE"):
        pytest.skip("only Linux has files without a name")
    (tmp_path / "a").write_bytes(b"old")
    child = os.fork()
    if not child:
        with files.writing([str(tmp_path / "a"), str(tmp_path / "b")]) as opened:
            opened[str(tmp_path / "a")].write(b"x" * 100_000)
            os.kill(os.getpid(), signal.SIGKILL)
    os.waitpid(child, 0)
    assert {each.name: each.read_bytes() for each in tmp_path.iterdir()} == {"a": b"old"}


@pytest.mark.skipif(not hasattr(os, "fchmod"), reason="permissions of POSIX")
@pytest.mark.parametrize("mode", [0o4755, 0o2755, 0o6711])
def test_the_rights_of_another_owner_do_not_go_over_to_what_is_written(tmp_path, mode):
    out = tmp_path / "out"
    out.write_bytes(b"old")
    out.chmod(mode)
    files.write_all({out: b"new"})
    assert stat.S_IMODE(out.stat().st_mode) == mode & 0o777


@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="gives files away")
def test_an_overwritten_file_keeps_its_owner_and_group(tmp_path):
    out = tmp_path / "out"
    out.write_bytes(b"old")
    os.chown(out, 12345, 12346)
    out.chmod(0o640)
    files.write_all({out: b"new"})
    assert (out.stat().st_uid, out.stat().st_gid, stat.S_IMODE(out.stat().st_mode)) == (12345, 12346, 0o640)


@pytest.mark.skipif(not hasattr(os, "fchown"), reason="groups of POSIX")
def test_a_group_that_cannot_be_kept_takes_its_rights_along(tmp_path, monkeypatch):
    out = tmp_path / "out"
    out.write_bytes(b"old")
    out.chmod(0o660)
    status = os.fstat

    def refuse(*args):
        raise PermissionError(1, "Operation not permitted")

    def of_another_group(handle):
        fields = list(status(handle))
        fields[5] += 1
        return os.stat_result(fields)

    monkeypatch.setattr(os, "fchown", refuse)
    monkeypatch.setattr(os, "fstat", of_another_group)
    files.write_all({out: b"new"})
    monkeypatch.undo()
    assert stat.S_IMODE(out.stat().st_mode) == 0o600
