"""Workers that die: nothing is lost, nothing is done twice."""

import json
import os
import pickle
import signal
import subprocess
import sys
import time
from collections import Counter
from functools import partial
from pathlib import Path

import pytest

from camcomp.compensation.batch import pools
from camcomp.compensation.batch.worker import Plan, Task
from camcomp.ground.errors import FileError
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from tests.cluster import Cluster, free_port
from tests.commandline import ROOT

GOOD = "G21 G90 G94\nG0 X0 Y0 Z5\nG1 Z0 F100\nX{x}\nM30\n"


def tasks(count, text=GOOD):
    plan = pickle.dumps(
        Plan(
            config=load_config([shipped("config/cartesian.yaml")]), output=Path("out"), method="newton", tolerance_um=1.0,
            joints=False, version="1",
        )
    )  # fmt: skip
    for i in range(count):
        yield Task(name=f"{i}.nc", key=f"key-{i}", data=text.format(x=i + 1).encode(), plan=plan)


def deadly(task, mark, always):
    """Stands in for the real work: the process that gets task 2 the first time dies."""
    if task.key in ("key-2", always):
        try:
            mark.touch(exist_ok=task.key != "key-2")
            os.kill(os.getpid(), signal.SIGKILL)
        except FileExistsError:
            pass
    time.sleep(0.01)
    return pools.Outcome(key=task.key, exit_code=0)


@pytest.mark.parametrize("always", ["", pytest.param("key-5", marks=pytest.mark.campaign)])
def test_a_worker_killed_on_this_machine_loses_nothing(monkeypatch, tmp_path, always):
    monkeypatch.setattr(pools, "work", partial(deadly, mark=tmp_path / "died", always=always))
    seen = {each.key: each.exit_code for each in pools.on_this_machine(tasks(12), 2)}
    assert seen == {f"key-{i}": pools.BUG if f"key-{i}" == always else 0 for i in range(12)}
    assert (tmp_path / "died").exists()


def test_several_processes_give_what_one_gives():
    one = {each.key: each.program for each in pools.on_this_machine(tasks(4), 1)}
    two = {each.key: each.program for each in pools.on_this_machine(tasks(4), 2)}
    assert one == two and None not in one.values()


def test_workers_execute_nothing_of_the_current_folder(tmp_path):
    names = ("json", "random", "types", "pickle", "sitecustomize", "numpy", "multiprocessing", "camcomp")
    for name in names:
        (tmp_path / f"{name}.py").write_text(f"open({str(tmp_path / 'executed')!r}, 'a').write('{name} ')\n")
    for i in range(2):
        (tmp_path / f"{i}.nc").write_text(GOOD.format(x=i + 1))
    words = [
        "batch",
        "0.nc",
        "1.nc",
        "--config",
        str(shipped("config/cartesian.yaml")),
        "--output-dir",
        "out",
        "--jobs",
        "2",
    ]
    start = f"import sys; sys.path.insert(0, {str(ROOT)!r}); from camcomp.terminal.cli import main; main(sys.argv[1:])"
    environment = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "PYTHONSAFEPATH")}
    done = subprocess.run(
        [sys.executable, "-P", "-c", start, *words],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert not (tmp_path / "executed").exists(), (tmp_path / "executed").read_text()
    assert done.returncode == 0, done.stderr


def test_no_scheduler_is_an_error(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(pools, "CONNECT", 0.5)
    with pytest.raises(FileError) as error:
        list(pools.on_a_cluster(tasks(1), f"tcp://127.0.0.1:{free_port()}"))
    assert error.value.rule == "CC503"


@pytest.fixture
def cluster(tmp_path):
    pytest.importorskip("distributed")
    made = Cluster(tmp_path)
    try:
        yield made
    finally:
        made.kill()


@pytest.mark.filterwarnings("default")
@pytest.mark.campaign  # processes of this machine have one in the plain run
def test_a_worker_killed_in_a_cluster_loses_nothing(cluster):
    cluster.work(2)
    cluster.wait(2)
    circles = "G21 G90 G94\nG0 X0 Y0 Z5\nG1 Z0 F100\nG3 X0 Y0 I{x} J0\nM30\n"
    seen: Counter = Counter()
    programs = {}
    for outcome in pools.on_a_cluster(tasks(12, circles), cluster.address):
        seen[outcome.key] += 1
        programs[outcome.key] = outcome.program
        if len(programs) == 3:
            os.killpg(cluster.workers[0].pid, signal.SIGKILL)
            cluster.workers[0].wait()
    assert seen == Counter({f"key-{i}": 1 for i in range(12)})
    alone = {each.key: each.program for each in pools.on_this_machine(tasks(12, circles), 1)}
    assert programs == alone


@pytest.mark.filterwarnings("default")
def test_without_workers_it_says_so_and_waits_and_another_version_is_refused(cluster, monkeypatch):
    cluster.wait()
    monkeypatch.setattr(pools, "PATIENCE", 0.2)
    monkeypatch.setattr(pools, "LOOK", 0.1)
    said = []

    def tell(text):
        said.append(text)
        cluster.work(1)

    assert [each.exit_code for each in pools.on_a_cluster(tasks(1), cluster.address, tell)] == [0]
    assert len(said) == 1 and "has no workers" in said[0]
    monkeypatch.setattr(pools, "__version__", "0.0.1")
    with pytest.raises(FileError, match="has camcomp .*, this is 0.0.1") as error:
        list(pools.on_a_cluster(tasks(1), cluster.address))
    assert error.value.rule == "CC505"


@pytest.mark.campaign  # a killed worker is in the plain run
@pytest.mark.filterwarnings("default")
def test_a_scheduler_that_dies_ends_the_batch_and_what_is_done_stays_done(cluster, tmp_path):
    cluster.work(1)
    cluster.wait(1)
    for name, text in {f"{i}.nc": GOOD.format(x=i + 1) for i in range(60)}.items():
        (tmp_path / "in").mkdir(exist_ok=True)
        (tmp_path / "in" / name).write_text(text)
    words = [sys.executable, "-m", "camcomp", "batch", "in", "--config", str(shipped("config/cartesian.yaml")), "--output-dir",
             "out"]  # fmt: skip
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    batch = subprocess.Popen(
        [*words, "--scheduler", cluster.address], cwd=tmp_path, env=environment, stderr=subprocess.PIPE, text=True
    )
    said = [batch.stderr.readline() for _ in range(5)]
    os.killpg(cluster.scheduler.pid, signal.SIGKILL)
    said += batch.communicate(timeout=60)[1].splitlines(keepends=True)
    assert batch.returncode == 5
    assert "error[CC503]: the Dask scheduler at tcp://127.0.0.1:" in "".join(said) and "Traceback" not in "".join(said)
    figures = json.loads((tmp_path / "out" / "camcomp-batch.json").read_text())
    assert [each["messages"] for each in figures["files"] if each["status"] == "error"] == []
    done = figures["counts"]["done"]
    assert 5 <= done < 60 and figures["counts"] == {**figures["counts"], "done": done, "not done": 60 - done}
    assert figures["exit_code"] == 5 and figures["programs"] == 60
    again = subprocess.run(
        [*words, "--jobs", "1"], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
    )
    assert f"60 programs: {60 - done} done, {done} unchanged" in again.stderr


# --- processes that go together -----------------------------------------------------------------------------------------


def children(pid):
    """Processes that `pid` and its children started, by the system's own list; workers are children of a server."""
    found = subprocess.run(["ps", "-o", "pid=", "--ppid", str(pid)], capture_output=True, text=True, check=False).stdout
    own = [int(each) for each in found.split()]
    return own + [each for child in own for each in children(child)]


def running(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks at processes as Linux shows them")
@pytest.mark.parametrize(
    "how",
    [
        pytest.param(signal.SIGKILL, marks=pytest.mark.campaign),
        signal.SIGTERM,
        pytest.param(signal.SIGINT, marks=pytest.mark.campaign),
    ],
)
def test_workers_end_with_the_batch_however_it_ends(tmp_path, how):
    for i in range(400):
        (tmp_path / "in").mkdir(exist_ok=True)
        (tmp_path / "in" / f"{i}.nc").write_text(GOOD.format(x=i + 1))
    batch = subprocess.Popen(
        [sys.executable, "-m", "camcomp", "batch", "in", "--config", str(shipped("config/cartesian.yaml")), "--output-dir", "out",
         "--jobs", "2"], cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)}, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    said = [batch.stderr.readline() for _ in range(3)]
    workers = children(batch.pid)
    assert len(workers) >= 3  # the server and two workers
    batch.send_signal(how)
    said += batch.communicate(timeout=30)[1].splitlines(keepends=True)
    assert batch.returncode == {signal.SIGKILL: -9, signal.SIGTERM: 143, signal.SIGINT: 130}[how]
    assert "Traceback" not in "".join(said)
    deadline = time.monotonic() + 5
    while any(running(each) for each in workers) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(running(each) for each in workers)
    if how != signal.SIGKILL:
        figures = json.loads((tmp_path / "out" / "camcomp-batch.json").read_text())
        assert figures["counts"]["done"] >= 3 and figures["programs"] == 400
    assert [each.name for each in (tmp_path / "out").rglob(".camcomp-*")] == []
