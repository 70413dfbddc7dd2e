"""Assignment of a recording's columns to those of the log: as stated by the user, else by usual names."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from operator import eq

from camcomp.diagnosis.recordings.numbered_joints import numbered_joints
from camcomp.diagnosis.recordings.sampled import SampledColumns, some
from camcomp.diagnosis.recordings.units import SI, factor_to, split_unit, unit_of
from camcomp.ground.bounds import number_of
from camcomp.ground.errors import ConfigError
from camcomp.model.motion.log_columns import DYNO, LINE, TEMPERATURE, TIME, TIP, TIP_SD, LogColumns, log_columns

_USUAL = {  # in addition to the log's own names, most specific first; those of actuators are below
    TIME: ("time_s", "time", "timestamp", "datetime", "date_time", "t", "zeit"),
    **{own: (f"measurement_{axis}", axis) for own, axis in zip(TIP, "xyz", strict=True)},
    TEMPERATURE: ("measurement_temperature", "temperature"),
}
_ACTUATOR = {  # names of an actuator's channels, {a}: its name; those of a drive count only with a unit of force or torque
    "setpoint": ("{a}_cmd", "{a}_command", "{a}_commanded", "{a}_setpoint", "{a}_target", "{a}_desired", "{a}_soll", "command_{a}", "target_{a}",
                 *(f"{{a}}{n}_{word}" for n in ("", "1") for word in ("command_position", "set_position", "cmd_pos", "set_pos"))),
    "encoder": ("{a}", "{a}_joint", "{a}_act", "{a}_actual", "{a}_measured", "{a}_ist", "{a}_position", "actual_{a}",
                *(f"{{a}}{n}_{word}" for n in ("", "1") for word in ("actual_position", "act_pos"))),
    "drive": ("{a}_torque", "{a}_force", "torque_{a}", "force_{a}", "act_{a}", "{a}_act", "{a}_actual"),
    "load": ("se_{a}", "{a}_load", "{a}_second"),
}  # fmt: skip
_OTHER_QUANTITIES = {"velocity", "effort", "acceleration", "rotation", "orientation", "angular", "covariance"}
_EFFORTS = {"N", "Nmm"}
_TURNING = re.compile(
    r"(.*[._ ])?(q[wxyz]|quat\w*|r[xyz]|rotvec\w*|roll|pitch|yaw|(rotation|orientation)[._]?[wxyz])([_ (\[].*)?",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Pick:
    """A column of a part; factor: to the unit of the log, None for an unstated unit."""

    part: int
    column: int
    factor: float | None


@dataclass
class Picked:
    """Assigned columns of the log, and columns with several candidates."""

    columns: dict[str, Pick] = field(default_factory=dict)
    times: dict[int, Pick] = field(default_factory=dict)  # by part
    doubtful: dict[str, list[str]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def pick_columns(
    parts: Sequence[SampledColumns], actuators: Sequence[str], columns: LogColumns, told: Mapping[str, str]
) -> Picked:
    """Columns of a log in the parts of a run. Raises ConfigError CC421 for a missing name in `told` (log: recording)."""
    picked = Picked()
    for log, theirs in told.items():
        hits = _told(parts, log, theirs, picked.notes)
        if log == TIME:
            picked.times |= {hit.part: hit for hit in hits}
        elif len(hits) > 1:
            message = f"column {theirs} stands there twice"
            raise ConfigError("CC421", message, at=parts[hits[1].part].at(-1, hits[1].column))
        else:
            picked.columns[log] = hits[0]
    usual = usual_names(actuators, columns)
    taken = {(each.part, each.column) for each in (*picked.columns.values(), *picked.times.values())}
    found = {log: _usual(parts, log, names, taken) for log, names in usual.items() if log not in (TIME, *told)}
    found |= _by_number(parts, columns, {log for log, hits in found.items() if hits} | set(told), picked.notes)
    for log, hits in found.items():
        rivals = [other for other in found if other != log and set(found[other]) & set(hits)]
        if len(hits) == 1 and not rivals:
            picked.columns[log] = hits[0]
        elif hits:
            picked.doubtful[log] = [parts[hit.part].names[hit.column] for hit in hits]
    for i, part in enumerate(parts):
        if part.time is None and TIME not in told:
            for hit in _usual([part], TIME, usual[TIME], {(0, column) for k, column in taken if k == i})[:1]:
                picked.times[i] = replace(hit, part=i)
    return picked


def _by_number(
    parts: Sequence[SampledColumns], columns: LogColumns, there: set[str], notes: list[str]
) -> dict[str, list[Pick]]:
    """Candidates for channels of which no column was found by name, in series of columns that count the joints."""
    out: dict[str, list[Pick]] = {}
    for i, part in enumerate(parts):
        for channel, series in numbered_joints([_plain(name) for name in part.names], len(columns.encoder)).items():
            logs = getattr(columns, channel)
            if there.intersection(logs):
                continue
            for each in series:
                names = f"{part.names[each[0]]} to {part.names[each[-1]]}"
                picks = [_pick(part, i, j, log, channel != "drive") for j, log in zip(each, logs, strict=True)]
                good = [pick for pick in picks if pick is not None]
                if len(good) < len(logs):
                    unit = unit_of(logs[0]).replace("Nmm", "Nm")
                    notes.append(f"{names} left out, they state no unit: {part.names[each[0]]}_{unit} would be one")
                    continue
                notes.append(f"{names} are taken as {logs[0]} to {logs[-1]}, in this order")
                for log, pick in zip(logs, good, strict=True):
                    out.setdefault(log, []).append(pick)
    return out


def _pick(part: SampledColumns, i: int, column: int, log: str, bare: bool) -> Pick | None:
    """A column as that of a log; None with a unit of another quantity, and without a unit unless it may be bare."""
    unit = _unit(part, column, log)
    factor = factor_to(log, unit) if unit else None
    return Pick(i, column, factor) if factor is not None or (bare and not unit) else None


def usual_names(actuators: Sequence[str], columns: LogColumns) -> dict[str, tuple[str, ...]]:
    """Usual names of every column of a log, in lower case, in the order of the log's columns."""
    out: dict[str, tuple[str, ...]] = {TIME: (), LINE: ()}
    for channel, names in _ACTUATOR.items():
        for a, log in zip(actuators, getattr(columns, channel), strict=True):
            out[log] = tuple(each.format(a=a) for each in names)
    out |= {each: () for each in (*TIP, *TIP_SD, *DYNO, TEMPERATURE)}
    drives = set(columns.drive)  # act_x is an encoder
    return {
        log: tuple(
            _plain(each)
            for each in (*more, *_USUAL.get(log, ()), *(() if log in drives else (log.rpartition("_")[0] or log,)))
        )
        for log, more in out.items()
    }


def check_enough(parts: Sequence[SampledColumns], picked: Picked, columns: LogColumns, *, program: bool) -> None:
    """Raise ConfigError CC421 for the first missing column that every study of such a run needs."""
    missing = _missing(set(picked.columns), columns, program)
    if missing:
        log = missing[0]
        names = [name for part in parts for name in part.names]
        rivals = picked.doubtful.get(log)
        could = f", it could be {some(rivals)}" if rivals else ""
        hint = f"name it: --column {log}=THEIRS; there are: {some(names, 40)}"
        if all(name.isdigit() for name in names):  # unnamed columns
            hint += "; or name all of them: --columns 'NAME NAME ...'"
        raise ConfigError("CC421", f"no column for {log}{could}", at=parts[0].at(-1, 0), hint=hint)


def _missing(there: set[str], columns: LogColumns, program: bool) -> list[str]:
    """Missing columns that a study of the present ones needs."""
    if there.intersection(TIP) and not there.issuperset(TIP):
        return [log for log in TIP if log not in there]
    if program or there.issuperset(columns.setpoint):
        measured = there.intersection((*TIP, *DYNO, *columns.encoder, *columns.drive))
        return [] if measured else list(columns.encoder)
    if there.intersection(TIP):
        return [log for log in columns.encoder if log not in there]
    axes = zip(columns.encoder, columns.setpoint, columns.drive, strict=True)
    if any(act in there and (cmd in there or drive in there) for act, cmd, drive in axes):
        return []
    return list(TIP if there.intersection(columns.encoder) else columns.encoder)


def unused_column_notes(parts: Sequence[SampledColumns], picked: Picked) -> list[str]:
    """Notes on unused columns."""
    used = {(each.part, each.column) for each in (*picked.columns.values(), *picked.times.values())}
    rest = [name for i, part in enumerate(parts) for j, name in enumerate(part.names) if (i, j) not in used]
    turning = [name for name in rest if _TURNING.fullmatch(name)]
    other = [name for name in rest if name not in turning]
    out = []
    if turning:
        out.append(f"orientation dropped, a log holds the place of the tip only: {some(turning)}")
    if other:
        out.append(f"{len(other)} column{'s' * (len(other) > 1)} dropped: {some(other)}")
    for log, names in picked.doubtful.items():
        out.append(f"{log} left out, it could be {some(names)}: --column says which")
    return out


def _told(parts: Sequence[SampledColumns], log: str, theirs: str, notes: list[str]) -> list[Pick]:
    """Columns with exactly this name, else in any case, else of `NAME*FACTOR`: at least one, at most one per part."""
    hits = _called(parts, theirs)
    name, _, text = theirs.rpartition("*")
    times = number_of(text) or 0.0
    if not hits and abs(times) > 0.0:  # not NaN
        hits = _called(parts, name)
        if hits:
            return [Pick(i, j, times) for i, j in hits]
    if not hits:
        names = {_plain(name): name for part in parts for name in part.names}
        close = get_close_matches(_plain(theirs), names, n=1)
        meant = f"did you mean {names[close[0]]}? " if close else ""
        hint = f"{meant}there are: {some(list(names.values()), 40)}"
        raise ConfigError("CC421", f"there is no column {theirs} for {log}", at=parts[0].at(-1, 0), hint=hint)
    out = []
    for i, j in hits:
        unit = _unit(parts[i], j, log)
        factor = factor_to(log, unit) if unit else None
        if unit and factor is None:
            notes.append(f"{theirs} is in {unit}, and is taken as {unit_of(log)} all the same")
        out.append(Pick(i, j, factor))
    return out


def _called(parts: Sequence[SampledColumns], theirs: str) -> list[tuple[int, int]]:
    """Part and number of the columns with a name, else with that name in any case."""
    every = [(i, j, name) for i, part in enumerate(parts) for j, name in enumerate(part.names)]
    return [(i, j) for i, j, name in every if name == theirs] or [
        (i, j) for i, j, name in every if name.lower() == theirs.lower() or _plain(name) == _plain(theirs)
    ]


def _usual(parts: Sequence[SampledColumns], log: str, usual: Sequence[str], taken: set[tuple[int, int]]) -> list[Pick]:
    """Columns of the first matching name: the log's own, a usual one, one with a unit, the end of a path."""
    free = [
        (i, j, _plain(name)) for i, part in enumerate(parts) for j, name in enumerate(part.names) if (i, j) not in taken
    ]
    stated = log.startswith("act_") and unit_of(log) in _EFFORTS
    for wanted in (log.lower(), *usual):
        for fits in (eq, _same_with_unit, _ends):
            bare = wanted == log.lower() or not stated
            tried = [_pick(parts[i], i, j, log, bare) for i, j, name in free if fits(name, wanted)]
            good = [pick for pick in tried if pick is not None]
            if len(good) > 1 and fits is eq:
                good = good[:1]  # twice in one table: an error when it is read
            if good:
                return good
    return []


def _unit(part: SampledColumns, column: int, log: str) -> str:
    """Unit stated by a recording; a name given by the user to a column without header states none."""
    name, stated = part.names[column], part.units[column]
    unit = "" if name == log and not part.headed else split_unit(name)[1]
    return unit if unit and stated in ("", SI) else stated


def _plain(name: str) -> str:
    """A name in lower case, its words (ActualPosition: two) joined by underscores, steps of a path by points."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z][a-z])", "_", name)
    return re.sub(r"(?<=\w)[\s-]+(?=\w)", "_", apart.lower().lstrip("/").replace("/", "."))


def _same_with_unit(name: str, wanted: str) -> bool:
    return split_unit(name)[0] == wanted


def _ends(name: str, wanted: str) -> bool:
    words = split_unit(name)[0].split(".")
    return len(words) > 1 and words[-1] == wanted and not _OTHER_QUANTITIES & set(words)


def match_columns(words: Sequence[str], actuators: Sequence[str], rotary: Sequence[bool]) -> dict[str, str]:
    """Parse `LOG=THEIRS` of the command line. Raises ConfigError CC421 for an unknown column of this machine's logs."""
    known = log_columns(actuators, rotary).known
    out: dict[str, str] = {}
    for word in words:
        log, mark, theirs = word.partition("=")
        if not mark or not theirs:
            raise ConfigError(
                "CC421", f"--column {word} is not LOG=THEIRS", hint=f"columns of a log: {', '.join(known)}"
            )
        if log not in known:
            close = get_close_matches(log, known, n=1)
            meant = f"did you mean {close[0]}? " if close else ""
            hint = f"{meant}columns of a log: {', '.join(known)}"
            raise ConfigError("CC421", f"--column {word}: a log of this machine has no column {log}", hint=hint)
        if log in out:
            raise ConfigError("CC421", f"--column names {log} twice")
        out[log] = theirs
    return out
