"""Workers that die: nothing is lost, nothing is done twice."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pytest

from camcomp.compensation.batch import pools
from camcomp.compensation.batch.worker import Task
from camcomp.ground.errors import FileError
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from tests.commandline import ROOT

GOOD = "G21 G90 G94\nG0 X0 Y0 Z5\nG1 Z0 F100\nX{x}\nM30\n"


def tasks(count, text=GOOD):
    config = load_config([shipped("config/cartesian.yaml")])
    for i in range(count):
        yield Task(f"{i}.nc", f"key-{i}", text.format(x=i + 1).encode(), config, "config", "newton", 1.0, False)


def deadly(task):
    """Stands in for the real work: the process that gets task 2 the first time dies."""
    mark = Path(os.environ["CAMCOMP_TEST_MARK"])
    if task.key in ("key-2", os.environ.get("CAMCOMP_TEST_ALWAYS")):
        try:
            mark.touch(exist_ok=task.key != "key-2")
            os.kill(os.getpid(), signal.SIGKILL)
        except FileExistsError:
            pass
    time.sleep(0.01)
    return pools.Outcome(task.key, 0)


@pytest.mark.parametrize("always", ["", "key-5"])
def test_a_worker_killed_on_this_machine_loses_nothing(monkeypatch, tmp_path, always):
    monkeypatch.setenv("CAMCOMP_TEST_MARK", str(tmp_path / "died"))
    monkeypatch.setenv("CAMCOMP_TEST_ALWAYS", always)
    monkeypatch.setattr(pools, "work", deadly)
    from joblib.externals.loky import get_reusable_executor

    get_reusable_executor().shutdown(wait=True)  # workers see the environment in which they start
    seen = {each.key: each.exit_code for each in pools.on_this_machine(tasks(12), 2)}
    get_reusable_executor().shutdown(wait=True)
    assert seen == {f"key-{i}": pools.BUG if f"key-{i}" == always else 0 for i in range(12)}
    assert (tmp_path / "died").exists()


def test_several_processes_give_what_one_gives():
    one = {each.key: each.program for each in pools.on_this_machine(tasks(4), 1)}
    two = {each.key: each.program for each in pools.on_this_machine(tasks(4), 2)}
    assert one == two and None not in one.values()


def test_no_scheduler_is_an_error():
    pytest.importorskip("distributed")
    with pytest.raises(FileError) as error:
        list(pools.on_a_cluster(tasks(1), f"tcp://127.0.0.1:{free_port()}"))
    assert error.value.rule == "CC503"


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def cluster(tmp_path):
    """A real scheduler and two worker processes on loopback: (address, worker processes)."""
    pytest.importorskip("distributed")
    port = free_port()
    address = f"tcp://127.0.0.1:{port}"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}

    def start(*words):
        command = [sys.executable, "-m", "distributed.cli." + words[0], *words[1:]]
        with open(tmp_path / f"{words[0]}-{time.monotonic_ns()}.log", "wb") as log:
            return subprocess.Popen(
                command, env=environment, cwd=tmp_path, stdout=log, stderr=log, start_new_session=True
            )

    started = [start("dask_scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard")]
    for _ in range(2):
        started.append(
            start("dask_worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1")
        )
    try:
        yield address, started[1:]
    finally:
        for each in started:
            if each.poll() is None:
                os.killpg(each.pid, signal.SIGKILL)
            each.wait()


@pytest.mark.filterwarnings("default")
def test_a_worker_killed_in_a_cluster_loses_nothing(cluster):
    address, workers = cluster
    from distributed import Client

    with Client(address, timeout=30, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=60)
    circles = "G21 G90 G94\nG0 X0 Y0 Z5\nG1 Z0 F100\nG3 X0 Y0 I{x} J0\nM30\n"
    seen: Counter = Counter()
    programs = {}
    for outcome in pools.on_a_cluster(tasks(12, circles), address):
        seen[outcome.key] += 1
        programs[outcome.key] = outcome.program
        if len(programs) == 3:
            os.killpg(workers[0].pid, signal.SIGKILL)
            workers[0].wait()
    assert seen == Counter({f"key-{i}": 1 for i in range(12)})
    alone = {each.key: each.program for each in pools.on_this_machine(tasks(12, circles), 1)}
    assert programs == alone
