"""One program of a batch, from bytes to bytes: what a worker process does, on this machine or on another one."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import threading
import warnings
from functools import lru_cache, partial
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
    from camcomp.compensation.program.totals import Totals
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
    config: bytes  # pickled once for all tasks
    method: str
    tolerance_um: float
    joints: bool
    stock: StockChoice | None = None
    passes: bool = False  # a program that was compensated before goes through unchanged


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
        return Outcome(
            key=task.key,
            exit_code=error.exit_code,
            messages=[_message(each, format_error(each)) for each in error.all()],
        )
    except MemoryError:
        text = "there is not enough memory"
        return Outcome(
            key=task.key,
            exit_code=FileError.exit_code,
            messages=[{"rule": "CC503", "message": text, "text": f"{task.name}: {text}"}],
        )
    except Exception as error:  # noqa: BLE001 - a bug in one program must not take the others with it
        text = f"internal error: {type(error).__name__}: {error}"
        return Outcome(
            key=task.key, exit_code=BUG, messages=[{"rule": None, "message": text, "text": f"{task.name}: {text}"}]
        )


def _compensate(task: Task) -> Outcome:
    from camcomp.compensation.program.compensate import compensate
    from camcomp.compensation.program.totals import Totals
    from camcomp.compensation.report.tables import joint_bytes
    from camcomp.gcode.stamp import is_stamped
    from camcomp.ground.errors import CheckFailed
    from camcomp.model.control import program_of
    from camcomp.model.from_program import job_of_program

    if is_stamped(task.data):
        if task.passes:
            return Outcome(key=task.key, exit_code=0, program=task.data)
        raise CheckFailed("CC603", f"{task.name} was compensated before")
    shared = _job(task.config)
    job = job_of_program(shared, task.data, task.name, task.stock)
    if (outcome := _in_pieces(task, job)) is not None:
        return outcome
    program = program_of(task.data, task.name, shared.config)
    result = compensate(program, job, method=task.method, tolerance_um=task.tolerance_um, version=__version__)
    joints = joint_bytes(result, job, TABLE) if task.joints else None
    return _outcome(task, Totals.of(result, job), result.written.data, joints)


def _in_pieces(task: Task, job: Job) -> Outcome | None:
    """The outcome of a long program, as `camcomp compensate` writes it; None: it is corrected as a whole."""
    from camcomp.compensation.file_to_file import CorrectionSettings, compensate_in_pieces
    from camcomp.compensation.report.tables import JointTable

    program, joints = BytesIO(), BytesIO()
    totals = compensate_in_pieces(
        source=BytesIO(task.data), name=task.name, job=job,
        settings=CorrectionSettings(method=task.method, tolerance_um=task.tolerance_um, version=__version__),
        program=program.write, joints=partial(JointTable, joints, TABLE, job) if task.joints else None,
    )  # fmt: skip
    if totals is None:
        return None
    return _outcome(task, totals, program.getvalue(), joints.getvalue() if task.joints else None)


def _outcome(task: Task, totals: Totals, program: bytes, joints: bytes | None) -> Outcome:
    failed = totals.failed_checks(task.tolerance_um)
    checks = [{"rule": rule, "message": text, "text": f"{task.name}: error[{rule}]: {text}"} for rule, text in failed]
    return Outcome(
        key=task.key, exit_code=int(bool(failed)), messages=checks, program=program, joints=joints,
        figures=totals.summary().as_json(), notes=held(),
    )  # fmt: skip


@lru_cache(maxsize=2)
def _job(config: bytes) -> Job:
    from camcomp.model.job import Job

    return Job(pickle.loads(config))


def _message(error: CamcompError, text: str) -> dict[str, Any]:
    where = {"file": error.at.file, "line": error.at.line, "column": error.at.column} if error.at else {}
    return {"rule": error.rule, "message": error.message, "text": text, **where}
