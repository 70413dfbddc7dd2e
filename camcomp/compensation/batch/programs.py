"""Many programs: which there are, which are done already, what became of each."""

from __future__ import annotations

import glob
import hashlib
import json
import os
import pickle
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import takewhile
from pathlib import Path
from typing import Any

from camcomp.compensation.batch.worker import Outcome, Plan, Task, messages_of
from camcomp.gcode.detect import endings
from camcomp.ground.errors import CamcompError, ConfigError, FileError
from camcomp.ground.files import alone_in, display_name, read_bytes, write_all
from camcomp.ground.places import one_place_each
from camcomp.ground.records import dataclass, field
from camcomp.model.config.yaml_tree import leaves, plain

SUFFIXES = (".nc", ".ngc", ".ncc", ".tap", ".gcode", ".cnc", ".eia", ".min", ".iso")  # of several dialects
STATE = ".camcomp"  # folder beside the outputs: what each was made from
DONE, FAILED_CHECK, SKIPPED, ERROR, OPEN = "done", "check failed", "unchanged", "error", "not done"


@dataclass(frozen=True)
class FoundProgram:
    """A program and its place in the output tree."""

    source: Path
    relative: Path


@dataclass(kw_only=True)
class Status:
    """What became of one program."""

    source: str
    output: str | None
    status: str
    exit_code: int
    figures: dict[str, Any] = field(default_factory=dict)
    messages: list[dict[str, Any]] = field(default_factory=list)


def find_programs(paths: Sequence[str], output: Path) -> list[FoundProgram]:
    """Programs of files, folders and patterns, each once, with mirrored places. Raises ConfigError CC271, FileError CC500.

    Folders are searched through for names with the usual endings; the output folder is left out. A pattern mirrors what
    lies behind its part without wildcards. A link is a program of its own, beside the file that it leads to.
    """
    found: dict[Path, Path] = {}
    usual = {*SUFFIXES, *endings()}
    out = Path(os.path.realpath(output))
    for text in paths:
        path = Path(text)
        if path.is_dir():
            base, files = path, [each for each in path.rglob("*") if each.suffix.lower() in usual]
        elif path.exists() or not glob.has_magic(text):
            if not path.exists():
                raise FileError("CC500", f"cannot read {text}: no such file")
            base, files = path.parent, [path]
        else:
            base = Path(*takewhile(lambda part: not glob.has_magic(part), path.parts))
            files = [Path(each) for each in glob.glob(text, recursive=True)]
        for each in sorted(files):
            place = Path(os.path.realpath(each.parent)) / each.name
            if (each.is_file() or (each.is_symlink() and not each.exists())) and not place.is_relative_to(out):
                found.setdefault(place, each.relative_to(base))
    if not found:
        raise ConfigError("CC271", f"no NC program in {', '.join(paths)}")
    places: dict[Path, Path] = {}
    for source, relative in found.items():
        if (other := places.setdefault(relative, source)) != source:
            raise FileError("CC502", f"{other} and {source} would both become {output / relative}")
    return [FoundProgram(source, relative) for relative, source in sorted(places.items())]


def key_of_config(plan: Plan) -> str:
    """Hash of the configuration, of the tables that it names, and of the options: by content, whatever the names."""
    config = plan.config
    options = (
        plan.version, plan.method, plan.tolerance_um, plan.joints, plan.stock, plan.passes, config.control.dialect,
    )  # fmt: skip
    digest = hashlib.sha256(repr(options).encode())
    assert config.tree is not None  # every loaded config has one
    for name, node in sorted(leaves(config.tree), key=lambda each: each[0]):
        value = plain(node)
        key = name.rpartition(".")[2]
        if (key == "file" or key.endswith("_file")) and isinstance(value, str):
            value = _hash(read_bytes(Path(node.at.file).parent / value))
        digest.update(repr((name, value)).encode())
    if config.spreads:
        digest.update(repr([(each.name, each.sd, each.group) for each in config.spreads]).encode())
    return digest.hexdigest()


def _hash(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


@contextmanager
def output_tree(plan: Plan, programs: Sequence[FoundProgram], others: Sequence[str]) -> Iterator[None]:
    """Within it the output folder is there, and this batch is alone in it.

    others: further outputs of the command. Raises FileError: CC502 when two outputs are one file, perhaps through links
    that lie in the folder, CC504 when another batch is writing there, CC501 when nothing can be written.
    """
    lock = plan.output / STATE / "lock"
    with alone_in(plan.output, lock):
        outputs = [path for each in programs for path in (*_targets(plan, each).values(), _note(plan, each))]
        two_files = not lock.with_name(lock.name.upper()).exists()
        one_place_each([*map(str, outputs), *others], capitals_count=two_files)
        yield


def run_batch(
    plan: Plan, programs: Sequence[FoundProgram], pool: Callable[[Iterable[Task]], Iterator[Outcome]]
) -> Iterator[Status]:
    """Every program's status, as soon as it is known. Outputs are written here, each with the note that it is done.

    What ends the pool (FileError, a signal) comes through, after the status of all that is known by then.
    """
    config_key, pickled = key_of_config(plan), pickle.dumps(plan)
    pending: dict[str, FoundProgram] = {}
    early: list[Status] = []

    def tasks() -> Iterator[Task]:
        for each in programs:
            try:
                data = read_bytes(each.source)
            except CamcompError as error:
                early.append(_refused(each, error))
                continue
            name = each.relative.as_posix()
            key = hashlib.sha256(os.fsencode(f"{config_key} {name} ") + hashlib.sha256(data).digest()).hexdigest()
            if (known := _known(plan, each, key)) is not None:
                early.append(known)
                continue
            pending[key] = each
            yield Task(name=display_name(each.source), key=key, data=data, plan=pickled)

    try:
        for outcome in pool(tasks()):
            while early:
                yield early.pop(0)
            yield _keep(plan, pending.pop(outcome.key), outcome)
    except FileError:
        yield from early
        raise
    yield from early


def _targets(plan: Plan, found: FoundProgram) -> dict[str, Path]:
    program = plan.output / found.relative
    targets = {"program": program}
    if plan.joints:
        targets["joints"] = program.with_name(program.name + ".joints.csv")
    return targets


def _note(plan: Plan, found: FoundProgram) -> Path:
    place = plan.output / STATE / found.relative
    return place.with_name(place.name + ".json")


def _known(plan: Plan, found: FoundProgram, key: str) -> Status | None:
    """The status of an earlier run, when the outputs are still what that run made of the same inputs."""
    targets = _targets(plan, found)
    try:
        note = json.loads(_note(plan, found).read_bytes())
        if note["key"] != key:
            return None
        if any(_hash(target.read_bytes()) != note["outputs"][name] for name, target in targets.items()):
            return None
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return _status(found, SKIPPED, note, targets["program"])


def _keep(plan: Plan, found: FoundProgram, outcome: Outcome) -> Status:
    """Write the outputs of a program and their hashes."""
    if outcome.program is None:
        return _status(found, ERROR, vars(outcome))
    made, targets = {"program": outcome.program, "joints": outcome.joints}, _targets(plan, found)
    contents = {target: made[name] or b"" for name, target in targets.items()}
    note = {
        "key": outcome.key,
        "exit_code": outcome.exit_code,
        "outputs": {name: _hash(contents[target]) for name, target in targets.items()},
        "figures": outcome.figures,
        "messages": outcome.messages,
    }
    try:
        for target in (*contents, _note(plan, found)):
            target.parent.mkdir(parents=True, exist_ok=True)
        write_all(contents, inputs=(found.source,))
        write_all({_note(plan, found): (json.dumps(note) + "\n").encode()})
    except OSError as error:
        return _refused(found, FileError("CC501", f"cannot write {error.filename}: {error.strerror}"))
    except CamcompError as error:
        return _refused(found, error)
    return _status(found, FAILED_CHECK if outcome.exit_code else DONE, vars(outcome), targets["program"])


def _refused(found: FoundProgram, error: CamcompError) -> Status:
    result = {"exit_code": error.exit_code, "figures": {}, "messages": messages_of(error)}
    return _status(found, ERROR, result)


def _status(found: FoundProgram, status: str, result: Mapping[str, Any], output: Path | None = None) -> Status:
    """A status with exit code, figures and messages of a result."""
    told = {name: result[name] for name in ("exit_code", "figures", "messages")}
    return Status(source=str(found.source), output=None if output is None else str(output), status=status, **told)


def summary(statuses: Sequence[Status], programs: Sequence[FoundProgram] = (), stopped: int = 0) -> dict[str, Any]:
    """The figures of a batch: counts, the exit code, and every program in the order of its name.

    stopped: exit code of what ended the batch before all of `programs` had their turn; those left are not done.
    """
    told = {each.source for each in statuses}
    left = [
        Status(source=str(each.source), output=None, status=OPEN, exit_code=stopped)
        for each in programs
        if str(each.source) not in told
    ]
    ordered = sorted([*statuses, *left], key=lambda each: each.source)
    counts = {name: sum(each.status == name for each in ordered) for name in (DONE, SKIPPED, FAILED_CHECK, ERROR, OPEN)}
    worst = {"max_um": max((each.figures["after"]["max_um"] for each in ordered if each.figures), default=0.0)}
    return {
        "programs": len(ordered),
        "counts": counts,
        "after": worst,
        "exit_code": max((each.exit_code for each in ordered), default=0),
        "files": [vars(each) for each in ordered],
    }
