"""One program of a batch, from bytes to bytes: what a worker process does, on this machine or on another one."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import threading
import warnings
from functools import lru_cache
from io import BytesIO
from typing import TYPE_CHECKING, Any

from camcomp import __version__
from camcomp.ground.errors import CamcompError, FileError, PluginWarning, format_error
from camcomp.ground.garbage import collect_seldom
from camcomp.ground.notes import held, hold
from camcomp.ground.old_names import keep_old_names
from camcomp.ground.progress import watched
from camcomp.ground.records import dataclass, field

if TYPE_CHECKING:
    from pathlib import Path

    from camcomp.model.config.spec import Config
    from camcomp.model.from_program import StockChoice
    from camcomp.model.job import Job

BUG = 70
TABLE = "joints.csv"
keep_old_names()  # tasks bring parameters of users' plug-ins, whose modules are imported before anything is asked of them


@dataclass(frozen=True, kw_only=True)
class Task:
    """A program with everything that is needed to compensate it."""

    name: str  # for messages
    key: str  # hash of all that decides the result
    data: bytes
    plan: bytes  # pickled once for all tasks


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Settings that all programs of a batch share."""

    config: Config
    output: Path
    method: str
    tolerance_um: float
    joints: bool
    version: str
    stock: StockChoice | None = None
    passes: bool = False  # programs that were compensated before go through unchanged


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What became of a task. exit_code as `camcomp compensate` would leave with; 0 and 1 have outputs, others not."""

    key: str
    exit_code: int
    messages: list[dict[str, Any]] = field(default_factory=list)  # rule, message, and where: file, line, column
    program: bytes | None = None
    joints: bytes | None = None
    figures: dict[str, Any] = field(default_factory=dict)
    version: str = __version__  # of the camcomp that did the work
    notes: dict[str, str] = field(default_factory=dict)  # by topic, for the user of the batch


def live_with_parent() -> None:
    """For worker processes of this machine: interrupts are the parent's business, and its end, however it comes, theirs."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    hold()
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def work(task: Task) -> Outcome:
    """Compensates a program on one core. Never raises."""
    collect_seldom()
    os.environ["CAMCOMP_THREADS"] = "1"  # the solver asks; the cores belong to the other workers
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PluginWarning)  # told once, by the process that asks for the batch
            with watched():  # a program is one step of the batch around it
                return _compensate(task)
    except CamcompError as error:
        return Outcome(key=task.key, exit_code=error.exit_code, messages=messages_of(error))
    except MemoryError:
        return failed(task.key, FileError.exit_code, "there is not enough memory", rule="CC503", where=f"{task.name}: ")
    except Exception as error:  # noqa: BLE001 - a bug in one program must not take the others with it
        text = f"internal error: {type(error).__name__}: {error}"
        return failed(task.key, BUG, text, where=f"{task.name}: ")


def failed(key: str, exit_code: int, text: str, *, rule: str | None = None, where: str = "") -> Outcome:
    """Outcome of a task without outputs; where: what stands in front of the text for the user."""
    return Outcome(key=key, exit_code=exit_code, messages=[{"rule": rule, "message": text, "text": where + text}])


def messages_of(error: CamcompError) -> list[dict[str, Any]]:
    """Messages of an error and of those that came with it."""
    return [
        {"rule": each.rule, "message": each.message, "text": format_error(each),
         **({"file": each.at.file, "line": each.at.line, "column": each.at.column} if each.at else {})}
        for each in error.all()
    ]  # fmt: skip


def _compensate(task: Task) -> Outcome:
    from camcomp.compensation.file_to_file import CorrectionSettings, OpenOutputs, compensate_into
    from camcomp.gcode.stamp import is_stamped
    from camcomp.model.from_program import job_of_program

    plan, job = _opened(task.plan)
    if plan.passes and is_stamped(task.data):
        return Outcome(key=task.key, exit_code=0, program=task.data)
    settings = CorrectionSettings(method=plan.method, tolerance_um=plan.tolerance_um, version=plan.version)
    job = job_of_program(job, task.data, task.name, plan.stock)
    program, joints = BytesIO(), BytesIO() if plan.joints else None
    outputs = OpenOutputs(program=program, joints=joints, table=TABLE)
    totals = compensate_into(BytesIO(task.data), task.name, job, settings, outputs)
    checks = [
        {"rule": rule, "message": text, "text": f"{task.name}: error[{rule}]: {text}"}
        for rule, text in totals.failed_checks(plan.tolerance_um)
    ]
    return Outcome(
        key=task.key, exit_code=int(bool(checks)), messages=checks, program=program.getvalue(),
        joints=None if joints is None else joints.getvalue(), figures=totals.summary().as_json(), notes=held(),
    )  # fmt: skip


@lru_cache(maxsize=2)
def _opened(plan: bytes) -> tuple[Plan, Job]:
    from camcomp.model.job import Job

    found: Plan = pickle.loads(plan)
    return found, Job(found.config)
