"""The kinds of faults. Each is a function of (random numbers, project) that does one trial and gives its verdict."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace

from tests.cluster import Cluster
from tests.commandline import ROOT
from tests.faults.judge import (
    CODES,
    COMPENSATE,
    MACHINE,
    OUTPUTS,
    PROGRAM,
    Verdict,
    compensate,
    contents,
    damage,
    wrong,
)
from tests.faults.material import EXPERIMENT, POSES, URDF
from tests.faults.mutate import mutated
from tests.faults.process import Ended, Fault, Shot, camcomp, environment

SLOW, FAST = 0.004, 0.0  # s that every step of writing takes longer
LONGEST = 0.25  # s, about the time of a compensation with slow steps


def _compensated(rng, project, fault=None, shot=None, signals=(), leftovers=False):
    folder = project.fresh([name for name in project.outputs.values() if rng.random() < 0.5])
    before = contents(folder)
    ended = camcomp(compensate(project.outputs), folder, fault, shot)
    lost = wrong(ended, signals) or damage(before, contents(folder), project.expected, leftovers=leftovers)
    if ended.code == 0 and not lost and not project.expected.items() <= contents(folder).items():
        lost = "exit 0 without all outputs"
    shutil.rmtree(folder)
    return ended, lost


def _long(trial):
    return lambda rng, project: trial(rng, project.long)


def _shot(number):
    def trial(rng, project):
        fault = Fault(slow_s=rng.choice((SLOW, FAST)))
        shot = Shot(number, rng.uniform(0.0, LONGEST))
        leftovers = number == signal.SIGKILL  # between getting a name and taking the target's place
        ended, lost = _compensated(rng, project, fault, shot, (number,), leftovers)
        return Verdict(ended.hit, lost)

    return trial


def disk_full_at_a_step(rng, project):
    ended, lost = _compensated(rng, project, Fault(full_at=rng.randint(1, 25)))
    if (
        not lost
        and ended.code == 5
        and not any(f"cannot write {name}: No space" in ended.said for name in project.outputs.values())
    ):
        lost = f"the full disk is told without its file: {ended.said}"
    return Verdict(ended.code == 5, lost)


def file_size_limit(rng, project):
    ended, lost = _compensated(rng, project, Fault(file_bytes=rng.randint(0, 30_000)))
    return Verdict(ended.code == 5, lost)


def small_disk(rng, project):
    """A disk of its own that is really full; for those who may mount one."""
    folder = project.fresh()
    disk = folder / "disk"
    disk.mkdir()
    size = rng.choice((4, 8, 12, 16, 24, 32, 48, 64)) * 1024
    if subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", disk], capture_output=True, check=False
    ).returncode:
        return Verdict(False)
    try:
        words = [f"disk/{word}" if word in OUTPUTS.values() else word for word in COMPENSATE]
        ended = camcomp(words, folder)
        lost = wrong(ended) or damage({}, contents(disk), project.expected)
    finally:
        subprocess.run(["umount", disk], check=True)
    shutil.rmtree(folder)
    return Verdict(ended.code == 5, lost)


def read_only_folder(rng, project):
    folder = project.fresh(["out.nc"])
    before = contents(folder)
    folder.chmod(0o500)
    verb = rng.choice(
        (COMPENSATE, ["batch", PROGRAM, "--config", MACHINE, "--output-dir", "tree", "--jobs", "1"], ["init", "new"])
    )
    ended = camcomp(verb, folder, Fault(powerless=True))
    lost = wrong(ended) or damage(before, contents(folder), {})
    folder.chmod(0o700)
    shutil.rmtree(folder)
    return Verdict(ended.code == 5, lost or (None if ended.code == 5 else f"exit {ended.code}"))


def little_memory(rng, project):
    folder = project.fresh()
    before = contents(folder)
    ended = camcomp(["simulate", PROGRAM, "--config", MACHINE, "-o", "log.csv", "--step-s", "0.0005"], folder,
                    Fault(memory_bytes=rng.randint(0, 40_000_000)))  # fmt: skip
    after = contents(folder)
    log = after.pop("log.csv", None)
    lost = wrong(ended) or damage(before, after, {}) or (None if (log is None) == (ended.code != 0) else "log or error")
    if not lost and log is not None and (not log.endswith(b"\n") or log.count(b"\n") != 8917):
        lost = f"half a log of {len(log)} bytes"
    shutil.rmtree(folder)
    return Verdict(ended.code != 0, lost)


def few_descriptors(rng, project):
    ended, lost = _compensated(rng, project, Fault(descriptors=rng.randint(0, 8)))
    return Verdict(ended.code != 0, lost)


# --- processes from their begin ---------------------------------------------------------------------------------------


def _started(words, folder, limits="", **more):
    command = f"{limits} exec {sys.executable} -m camcomp {' '.join(map(str, words))}"
    try:
        done = subprocess.run(
            ["bash", "-c", command],
            cwd=folder,
            env=environment(**more),
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return Ended(0, "", hung=True)
    return Ended(done.returncode, done.stderr)


def little_memory_from_the_begin(rng, project):
    """The interpreter, the linear algebra and the compiler may be what ends: then they do so in their own words."""
    folder = project.fresh()
    before = contents(folder)
    ended = _started(COMPENSATE, folder, f"ulimit -v {rng.randint(60_000, 900_000)};")
    lost = damage(before, contents(folder), project.expected)
    if ended.hung or ended.code == 70 or "This is a bug in camcomp" in ended.said:
        lost = f"exit {ended.code}: {ended.said[-300:]}"
    shutil.rmtree(folder)
    return Verdict(ended.code != 0, lost)


def damaged_compiled_code(rng, project):
    """Files of compiled code that are cut off, spoilt, foreign or of no use."""
    folder = project.fresh()
    warm = project.warm_code(_started)
    cache = folder.with_name(folder.name + ".code")
    shutil.copytree(warm, cache)
    for path in sorted(cache.rglob("*.nbc")):
        data = path.read_bytes()
        k = rng.randrange(len(data))
        way = rng.randrange(5)
        if way == 0:
            path.write_bytes(data[:k])
        elif way == 1:
            path.write_bytes(data[:k] + bytes([data[k] ^ 1 << rng.randrange(8)]) + data[k + 1 :])
        elif way == 2:
            path.write_bytes(rng.randbytes(len(data)))
        elif way == 3:
            path.unlink()
            path.mkdir()
        else:
            path.rename(path.with_name("of-another-python.nbc"))
    verdict = _with_code(project, folder, cache, notes=1)
    return verdict


def no_home_and_no_place(rng, project):
    """A service user in a container: nothing may be written, there is no home.

    One note says why the named folder is not used, another that no folder is left.
    """
    folder = project.fresh()
    package = folder.with_name(folder.name + ".package")
    shutil.copytree(ROOT / "camcomp", package / "camcomp", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(ROOT / "config", package / "config")
    for each in [each for each in package.rglob("*") if each.is_dir()]:
        (each / "__pycache__").write_bytes(b"")  # nobody can make a folder of this name
    verdict = _with_code(
        project, folder, "/dev/null/none", notes=2, PYTHONPATH=str(package), HOME="/dev/null", XDG_CACHE_HOME=""
    )
    shutil.rmtree(package)
    return verdict


def two_cold_starts_at_once(rng, project):
    cache = project.fresh()
    folders = [project.fresh() for _ in range(2)]
    running = [
        subprocess.Popen(
            [sys.executable, "-m", "camcomp", *COMPENSATE], cwd=each, env=environment(NUMBA_CACHE_DIR=str(cache)),
            stderr=subprocess.PIPE, text=True,
        ) for each in folders
    ]  # fmt: skip
    lost = None
    for process, folder in zip(running, folders, strict=True):
        said = process.communicate(timeout=300)[1]
        lost = (
            lost
            or wrong(Ended(process.returncode, said))
            or damage(contents(folder), contents(folder), project.expected)
        )
    verdict = _with_code(project, project.fresh(), cache, notes=0)
    return Verdict(True, lost or verdict.lost)


def _with_code(project, folder, cache, notes, **more):
    """A compensation with compiled code in `cache`: right, with so many notes at most."""
    before = contents(folder)
    ended = _started(COMPENSATE, folder, **{"NUMBA_CACHE_DIR": str(cache), **more})
    lost = wrong(ended) or damage(before, contents(folder), project.expected)
    if not lost and (ended.code != 0 or ended.said.count("note:") > notes):
        lost = f"exit {ended.code}: {ended.said}"
    shutil.rmtree(folder)
    shutil.rmtree(cache, ignore_errors=True)
    return Verdict(True, lost)


# --- batches ----------------------------------------------------------------------------------------------------------

PROGRAMS = 12


def _batch(folder, *more):
    for i in range(PROGRAMS):
        (folder / "in").mkdir(exist_ok=True)
        text = f"G21 G90 G94\nG0 X0 Y0 Z5\nG1 Z0 F100\nG3 X0 Y0 I{i + 1} J0\nM30\n"
        (folder / "in" / f"{i}.nc").write_text(text)
    config = ROOT / "config" / "cartesian.yaml"
    return [sys.executable, "-m", "camcomp", "batch", "in", "--config", str(config), "--output-dir", "out", *more]


def _resumed(project, folder, hit, lost):
    """After whatever happened: a second run brings what an undisturbed one brings, and all tells of it."""
    outputs = {name: data for name, data in contents(folder / "out").items() if not name.startswith(".camcomp/")}
    expected = project.batch(_batch)
    half = [name for name, data in outputs.items() if name in expected and data != expected[name]]
    strange = [name for name in outputs if name not in expected and name != "camcomp-batch.json"]
    again = subprocess.run(
        _batch(folder, "--jobs", "1"), cwd=folder, env=environment(), capture_output=True, text=True, check=False
    )
    made = {name: data for name, data in contents(folder / "out").items() if name.endswith(".nc")}
    if not lost and (half or strange):
        lost = f"half-written {half}, left over {strange}"
    if not lost and (again.returncode != 0 or made != expected):
        lost = f"not resumed: exit {again.returncode}: {again.stderr[-300:]}"
    shutil.rmtree(folder)
    return Verdict(hit, lost)


def batch_killed(rng, project):
    folder = project.fresh()
    number = rng.choice((signal.SIGKILL, signal.SIGTERM, signal.SIGINT))
    process = subprocess.Popen(
        _batch(folder, "--jobs", "2"), cwd=folder, env=environment(), stderr=subprocess.PIPE, text=True
    )
    try:
        process.wait(rng.uniform(0.5, 4.0))
    except subprocess.TimeoutExpired:
        process.send_signal(number)
    hit = process.returncode is None
    said = process.communicate(timeout=60)[1]
    early = "Traceback" in said and "camcomp/terminal/cli.py" not in said  # Python itself was still starting
    lost = None if early else wrong(Ended(process.returncode, said), (number,))
    time.sleep(1.0)
    return _resumed(project, folder, hit, lost)


def _cluster_trial(rng, project, victim, code):
    folder = project.fresh()
    (folder.with_name(folder.name + ".dask")).mkdir()
    cluster = Cluster(folder.with_name(folder.name + ".dask"))
    try:
        cluster.work(2)
        cluster.wait(2)
        process = subprocess.Popen(
            _batch(folder, "--scheduler", cluster.address),
            cwd=folder,
            env=environment(),
            stderr=subprocess.PIPE,
            text=True,
        )
        said = "".join(process.stderr.readline() for _ in range(rng.randint(1, 6)))
        target = victim(cluster)
        os.killpg(target.pid, signal.SIGKILL)
        target.wait()
        said += process.communicate(timeout=120)[1]
    finally:
        cluster.kill()
    lost = wrong(Ended(process.returncode, said))
    figures = json.loads((folder / "out" / "camcomp-batch.json").read_text())
    if not lost and (process.returncode not in code or figures["programs"] != PROGRAMS):
        lost = f"exit {process.returncode}: {said[-300:]}"
    return _resumed(project, folder, True, lost)


def dask_worker_killed(rng, project):
    return _cluster_trial(rng, project, lambda cluster: cluster.workers[0], (0,))


def dask_scheduler_killed(rng, project):
    return _cluster_trial(rng, project, lambda cluster: cluster.scheduler, (0, 5))  # 0: it was done already


# --- spoilt inputs ----------------------------------------------------------------------------------------------------


def _spoilt(rng, project, files, verbs, made=()):
    """One file of `files` spoilt; verbs: command lines to choose from; made: names that may appear."""
    folder = project.fresh()
    for name, data in files.items():
        (folder / name).write_bytes(data)
    name = rng.choice(sorted(files))
    (folder / name).write_bytes(mutated(files[name], rng))
    before = contents(folder)
    words = rng.choice(verbs)
    ended = camcomp(words, folder, Fault(memory_bytes=1 << 32))
    after = contents(folder)
    lost = wrong(ended) or damage(
        {name: data for name, data in before.items()}, {n: d for n, d in after.items() if n not in made}, {}
    )
    lost = lost or next((f"{n} is half-written" for n in made if n in after and not _whole(n, after[n])), None)
    if lost:
        lost += f" [{' '.join(words)}; {before[name]!r}]"
    shutil.rmtree(folder)
    return Verdict(ended.code in CODES and ended.code != 0, lost)


def _whole(name, data):
    if name.endswith(".json"):
        json.loads(data, parse_constant=lambda text: 1 / 0)
    return bool(data) and (not name.endswith(".csv") or data.endswith(b"\n"))


def spoilt_machine(rng, project):
    source = rng.choice(("orthoglide.yaml", "cartesian.yaml", "router.yaml", "puu.yaml", "kuka-kr210.yaml"))
    files = {MACHINE: (ROOT / "config" / source).read_bytes()}
    verbs = [
        ["validate", MACHINE, "--json", "found.json"],
        ["config", "show", "--config", MACHINE],
        ["compensate", PROGRAM, "--config", MACHINE, "-o", "made.nc"],
        ["simulate", PROGRAM, "--config", MACHINE, "-o", "made.csv", "--step-s", "0.2"],
    ]
    return _spoilt(rng, project, files, verbs, ("found.json", "made.nc", "made.csv"))


def spoilt_program(rng, project):
    files = {PROGRAM: (ROOT / "samples" / "groove-circle-2.nc").read_bytes()}
    verbs = [["canon", PROGRAM], ["compensate", PROGRAM, "--config", MACHINE, "-o", "made.nc"], ["validate", PROGRAM]]
    return _spoilt(rng, project, files, verbs, ("made.nc",))


def spoilt_experiment(rng, project):
    files = {name: data for name, data in EXPERIMENT.items() if name.endswith(".yaml")}
    rest = {name: data for name, data in EXPERIMENT.items() if name not in files}
    project = replace_files(project, rest)
    return _spoilt(
        rng,
        project,
        files,
        [["validate", "experiment.yaml"], ["diagnose", "experiment.yaml", "--json", "d.json"]],
        ("d.json",),
    )


def spoilt_log(rng, project):
    logs = {name: data for name, data in EXPERIMENT.items() if name.endswith(".csv")}
    rest = {name: data for name, data in EXPERIMENT.items() if name not in logs}
    verbs = [
        ["compare", "log-1.csv", "log-2.csv", "--json", "d.json"],
        ["compare", "log-2.csv", "log-1.csv", "--json", "d.json"],
        ["diagnose", "experiment.yaml", "--json", "d.json"],
    ]
    return _spoilt(rng, replace_files(project, rest), logs, verbs, ("d.json",))


def spoilt_recording(rng, project):
    verbs = [["import", "poses.csv", "--config", MACHINE, "-o", "made"]]
    project = replace_files(project, {MACHINE: (ROOT / "config" / "ur10.yaml").read_bytes()})
    return _spoilt(rng, project, {"poses.csv": POSES}, verbs, ("made/poses.csv", "made/experiment.yaml"))


def spoilt_urdf(rng, project):
    made = tuple(f"made/{each}" for each in ("machine.yaml", "groove.nc", "camcomp.schema.json", "README.md"))
    return _spoilt(rng, project, {"arm.urdf": URDF}, [["init", "made", "--from-urdf", "arm.urdf"]], made)


def replace_files(project, files):
    """The project with further files in every fresh folder."""
    return replace(project, more={**project.more, **files})


def spoilt_set_points(rng, project):
    lines = b"x_mm,y_mm,z_mm,fx_N,fy_N,fz_N\n" + b"1,2,-3,10,20,30\n" * 5
    folder = project.fresh()
    data = mutated(lines, rng)
    ended = camcomp(["stream", "--config", MACHINE], folder, stdin=data.decode("utf-8", "surrogateescape"))
    lost = wrong(ended)
    shutil.rmtree(folder)
    return Verdict(ended.code != 0, lost and f"{lost} [{data!r}]")


# name: (trial, trials in the short version, share of the time in the long one)
KINDS = {
    "kill -9 while compensating": (_shot(signal.SIGKILL), 6, 8),
    "kill -15 while compensating": (_shot(signal.SIGTERM), 6, 8),
    "kill -2 while compensating": (_shot(signal.SIGINT), 6, 8),
    "disk full at a step of writing": (disk_full_at_a_step, 4, 6),
    "kill -9 in a long program": (_long(_shot(signal.SIGKILL)), 3, 4),
    "kill -15 in a long program": (_long(_shot(signal.SIGTERM)), 3, 4),
    "disk full in a long program": (_long(disk_full_at_a_step), 3, 4),
    "limit on the size of files": (file_size_limit, 2, 3),
    "a small disk, really full": (small_disk, 2, 3),
    "read-only folder": (read_only_folder, 2, 3),
    "little memory, running": (little_memory, 3, 5),
    "little memory, from the begin": (little_memory_from_the_begin, 0, 6),
    "few descriptors": (few_descriptors, 3, 4),
    "compiled code damaged or foreign": (damaged_compiled_code, 0, 8),
    "no home, no writable folder": (no_home_and_no_place, 0, 3),
    "two cold starts at once": (two_cold_starts_at_once, 0, 3),
    "batch killed (-9, -15, -2), resumed": (batch_killed, 0, 8),
    "Dask worker killed": (dask_worker_killed, 0, 5),
    "Dask scheduler killed": (dask_scheduler_killed, 0, 5),
    "machine file spoilt": (spoilt_machine, 3, 4),
    "program spoilt": (spoilt_program, 3, 2),
    "experiment spoilt": (spoilt_experiment, 2, 3),
    "log spoilt": (spoilt_log, 2, 4),
    "recording spoilt": (spoilt_recording, 2, 2),
    "URDF spoilt": (spoilt_urdf, 3, 2),
    "set-points spoilt": (spoilt_set_points, 2, 2),
}
