"""What something that no library states may depend on: families of functions of one thing, at the rows of a problem."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from camcomp.diagnosis.fit.columns import grounds
from camcomp.diagnosis.fit.patterns import MOVES_MM, Ground, of_actuator
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.ground.datatypes import Bools, Floats, Ints

WAVES = 24  # half waves along a travel: a bump of a twentieth of it is still followed
SLOW = 6  # of them that a guide's bow needs
MOVES_DRIVE = 1e-6  # of a drive, mm or rad, on which something can depend
NOTHING = 1e-9  # energy of a white column that does nothing
SAME = 1.0 - 1e-9  # correlation of two places that are one
DEGREE = 4  # of the polynomials of what depends on several axes at once
IN_A_RUN = 8  # degree of those of time, for every run anew
OF_WHAT_MOVES = ("velocity", "reversal", "force", "acceleration", "direction", "temperature")


@dataclass(frozen=True, eq=False)
class Family:
    """Functions of one thing: name, which of all white rows (w,) they touch, their white columns there (rows, p).

    parts: columns (each (q,) of p) that can be there alone: of one axis, of one thing that a drive does.
    """

    name: str
    at: Bools
    columns: ByChannel
    parts: tuple[Ints, ...]

    def alone(self, part: Ints) -> "Family":
        """The family of some of the functions."""
        every = np.arange(len(part))
        return Family(self.name, self.at, self.columns.placed(part, every, len(part)), (every,))


def kinds(problem: Problem) -> Ints:
    """Index of the kind of channel of every white row (w,)."""
    return np.concatenate([np.repeat(np.arange(len(p)), [len(part) for part in p]) for p in problem.white_patterns])


def alone(problem: Problem) -> Iterator[Family]:
    """Every part of every family by itself."""
    for family in families(problem):
        for part in family.parts:
            yield family.alone(part)


def families(problem: Problem) -> Iterator[Family]:
    """Of all that something unknown may depend on."""
    everywhere = kinds(problem)
    kinds_of = [words.kind for words in problem.dictionaries]
    names = [name for words in problem.dictionaries for name in words.labels]
    whole = np.array([name.split(":")[0] for name in names])
    # the first of an axis' functions of time is one throughout: an unknown effect has some mean
    constant = [words.kind == "tip" and name.startswith("time:") and name not in words.labels[:n]
                for words in problem.dictionaries for n, name in enumerate(words.labels)]  # fmt: skip
    of = np.repeat(np.arange(len(problem.dictionaries)), [len(words.labels) for words in problem.dictionaries])
    for word in OF_WHAT_MOVES:
        picked = np.flatnonzero(whole == word)
        if len(picked):
            picked = np.concatenate([picked, np.flatnonzero(constant)])
            yield Family(
                word, np.ones(len(everywhere), bool), _patterns(problem, picked, of), (np.arange(len(picked)),)
            )
    if "tip" not in kinds_of:
        return
    at, every = everywhere == kinds_of.index("tip"), grounds(problem.bench)
    for name, values in _of_place(every):
        p = values[0].shape[1]
        axes = [np.arange(p) + axis * p for axis in range(3)]
        bows = [each[:SLOW] for each in axes] if name.startswith("position") else []
        columns = _white_tip(problem, values)
        yield Family(name, at, columns, _doing(columns, (np.arange(3 * p), *axes, *bows)))
    for j, name in enumerate(problem.bench.actuators):
        functions = _of_drive(every, j)
        ends = np.cumsum([0, *(each.shape[1] for each in functions[0].values())])
        columns = _white_way(problem, j, functions)
        yield Family(f"drive {name}", at, columns, _doing(columns, np.split(np.arange(ends[-1]), ends[1:-1])))


def _doing(columns: ByChannel, parts: Sequence[Ints]) -> tuple[Ints, ...]:
    """The parts without columns that do nothing: of a drive at rest, or that turns the tool about itself, of an axis that nobody measured."""
    does = columns.energy() > NOTHING
    return tuple(part[does[part]] for part in parts if does[part].any())


def _patterns(problem: Problem, picked: Ints, of: Ints) -> ByChannel:
    """White columns (w, p) of some of the patterns of all kinds of channels."""
    out: list[tuple[Ints, Floats]] = []
    for parts in problem.white_patterns:
        for kind, part in enumerate(parts):
            mine = np.flatnonzero(of[picked] == kind)
            out += part.placed(picked[mine] - int(np.searchsorted(of, kind)), mine, len(picked)).parts
    return ByChannel(len(picked), tuple(out))


def _of_place(every: Sequence[Ground]) -> Iterator[tuple[str, list[Floats]]]:
    """Names, and functions (n, p) per run, of places, of positions, of several axes at once, and of time in each run."""
    tips, drives = [g.tip for g in every], [g.motion.encoder for g in every]
    places = [np.concatenate([tip, drive], axis=1) for tip, drive in zip(tips, drives, strict=True)]
    low = np.min([p.min(axis=0) for p in places], axis=0)
    span = np.max([p.max(axis=0) for p in places], axis=0) - low
    u = [(p - low) / np.maximum(span, 1e-9) for p in places]
    least, seen = np.repeat([MOVES_MM, MOVES_DRIVE], [3, len(span) - 3]), np.concatenate(u)
    moving = np.flatnonzero(span > least)
    for n, a in enumerate(moving):
        if any(abs(np.corrcoef(seen[:, a], seen[:, b])[0, 1]) > SAME for b in moving[:n]):
            continue  # of a machine of slides: the axis is the drive's
        yield f"position {a}", [_waves(x[:, a]) for x in u]
    axes = [a for a in moving if a < 3]
    powers = [d for d in product(range(DEGREE + 1), repeat=len(axes)) if sum(d) <= DEGREE]
    leg = np.polynomial.legendre.legvander
    if axes:
        high = [leg(2.0 * x[:, axes] - 1.0, DEGREE) for x in u]  # (n, axes, degrees)
        yield (
            "place",
            [np.stack([np.prod([h[:, n, e] for n, e in enumerate(d)], axis=0) for d in powers], 1) for h in high],
        )
    runs = range(len(every))
    yield "time", [np.kron(np.eye(len(every))[r], leg(np.linspace(-1, 1, len(every[r].tip)), IN_A_RUN)) for r in runs]


def _of_drive(every: Sequence[Ground], j: int) -> list[dict[str, Floats]]:
    """Functions (n, p) per run of what drive j does, by covariate."""
    low = min(float(g.motion.encoder[:, j].min()) for g in every)
    span = max(float(g.motion.encoder[:, j].max()) for g in every) - low
    out = []
    for g, functions in zip(every, of_actuator(every, j), strict=True):
        waves = (
            _waves((g.motion.encoder[:, j] - low) / max(span, 1e-9))
            if span > MOVES_DRIVE
            else np.zeros((len(g.tip), 0))
        )
        out.append({**{name: np.stack(each, axis=1) for name, each in functions.items()}, "position": waves})
    return out


def _waves(u: Floats) -> Floats:
    """Half waves (n, p) along a travel 0 .. 1, the shorter the smaller."""
    k = np.arange(WAVES + 1)
    return np.asarray(np.cos(np.pi * k * u[:, None]) / np.maximum(k, 1))


def _white_way(problem: Problem, j: int, functions: Sequence[Mapping[str, Floats]]) -> ByChannel:
    """White rows of the tip (rows, p) of functions per run by which drive j strays, in um or urad."""
    out = []
    for k, one in enumerate(functions):
        way, values = problem.bench.thin_slopes(k)[:, :, j], 1e-3 * np.concatenate(list(one.values()), axis=1)
        p = values.shape[1]
        axes = ByChannel(p, tuple((np.arange(p), way[:, axis, None] * values) for axis in range(3)))
        out.append(problem.noise.by_channel(k, axes, problem.inflate[k], problem.times[k]))
    return ByChannel.behind(out)


def _white_tip(problem: Problem, values: Sequence[Floats]) -> ByChannel:
    """White rows of the tip (rows, 3 p) of functions (n, p) per run, each on each axis, in um."""
    out = []
    for k, one in enumerate(values):
        p = one.shape[1]
        axes = ByChannel(3 * p, tuple((axis * p + np.arange(p), 1e-3 * one) for axis in range(3)))
        out.append(problem.noise.by_channel(k, axes, problem.inflate[k], problem.times[k]))
    return ByChannel.behind(out)
