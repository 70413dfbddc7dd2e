"""Laws that were found before: a folder of them, offered as candidates for the next machine.

Every term of a law has its own factor on the next machine, so that a wave may have another phase there; periods, places and
lengths stay.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from camcomp.diagnosis.fit.bench import CandidateCause
from camcomp.diagnosis.law.describe import where_of
from camcomp.diagnosis.result.types import Law, LawPart
from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError, Location
from camcomp.ground.files import display_name, read_bytes, write_all
from camcomp.model.effect import Load, Motion, Parameter
from camcomp.model.law.covariates import DriveRows, TipRows, load_of
from camcomp.model.law.expression import FormulaError
from camcomp.model.law.law import EmpiricalLaw
from camcomp.model.law.spec import FormulaSpec, MapSpec

_SOURCE = "the law found before, 1: as large as there"


@dataclass(frozen=True)
class LearnedLaw:
    """A law by its name in the library, and the machine on which it was found."""

    name: str
    machine: str
    law: Law

    def pieces(self) -> list[tuple[LawPart, float]]:
        """Its terms as parts of their own, each with the size that it had."""
        if self.law.kind == "map":
            return [(each, 1.0) for each in self.law.parts]
        out = []
        for term in self.law.terms:
            where, text = term.term.split(": ", 1)
            if text == "1":  # effects of the library say what does not depend on anything
                continue
            for part in (each for each in self.law.parts if where_of(each) == where):  # a force is put to work nowhere
                out.append((part.model_copy(update={"formula": text}), term.value))
        return out

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """One factor per term."""
        count = len(self.pieces())
        names = ["factor"] if count == 1 else [f"factor_{k}" for k in range(1, count + 1)]
        return tuple(Parameter(name, "1", 0.0, -20.0, 20.0, 1.0, 0.01, _SOURCE) for name in names)

    def candidate(self, actuators: Sequence[str]) -> CandidateCause | None:
        """The law as a candidate on a machine with these actuators; None where it cannot act there."""
        pieces = self.pieces()
        if not pieces or any(part.target is not None and part.target not in actuators for part, _ in pieces):
            return None
        laws = [_placed(part, size) for part, size in pieces]
        if any(load_of(name) not in (None, *actuators) for law in laws for name in law.shape.names):
            return None
        at = [None if part.target is None else list(actuators).index(part.target) for part, _ in pieces]
        names = [p.name for p in self.parameters]
        hooks = {"control": ("on_servo", _shift), "drive": ("on_drive", _shift)}
        effect: dict[str, Any] = {
            "__doc__": self.law.says, "TARGET": "machine", "SOURCE": _SOURCE, "STAGE": self.law.on, "PARAMETERS": self.parameters
        }  # fmt: skip
        stages = [law.on if law.on in hooks else "tip" for law in laws]
        for stage in dict.fromkeys(stages):
            every = zip(stages, names, laws, at, strict=True)
            own = [(name, law, actuator) for on, name, law, actuator in every if on == stage]
            hook, moves = hooks.get(stage, ("on_place", _move))
            effect[hook] = staticmethod(partial(moves, own))
        return CandidateCause(self.name, None, type("LearnedEffect", (), effect))

    def entries(self, factors: Mapping[str, float]) -> list[dict[str, Any]]:
        """What puts the law to work in a machine file, its terms as large as found."""
        out = []
        for (part, size), parameter in zip(self.pieces(), self.parameters, strict=True):
            factor = factors.get(parameter.name, 0.0)
            if part.effect == "map":
                own: Any = part.coefficients_mm
                scaled = [[factor * v for v in row] if isinstance(row, tuple | list) else factor * row for row in own]
                part = part.model_copy(update={"coefficients_mm": scaled})
            else:
                part = part.model_copy(update={"formula": f"{factor * size:.6g}*{part.formula}"})
            out.append(part.model_dump(exclude_none=True))
        return out


_Pieces = Sequence[tuple[str, EmpiricalLaw, int | None]]  # the factor's name, the law, and the index of its actuator


def _shift(pieces: _Pieces, values: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Values (n, m) of actuators with the pieces of one stage."""
    out = values.copy()
    for factor, law, actuator in pieces:
        if p[factor] != 0.0:
            out[:, actuator] += p[factor] * law.values(DriveRows(motion, int(actuator or 0)))
    return out


def _move(pieces: _Pieces, tip: Floats, load: Load, motion: Motion, p: Mapping[str, float]) -> Floats:
    """Tips (n, 3) in the program frame with the pieces that move them."""
    rows, out = TipRows(tip, load, motion), tip.copy()
    for factor, law, _ in pieces:
        if p[factor] != 0.0:
            out[:, law.axis] += p[factor] * law.values(rows)
    return out


def _placed(part: LawPart, size: float) -> EmpiricalLaw:
    keys = part.model_dump(exclude_none=True, exclude={"effect", "target"}, mode="json")
    return replace((MapSpec if part.effect == "map" else FormulaSpec).model_validate(keys).law, factor=size)


def keep(folder: str, law: Law, machine: str) -> str:
    """Writes a law into the library; its name there. The same law twice is one. Raises FileError."""
    name = "law_" + hashlib.sha256(law.formula.encode()).hexdigest()[:8]
    text = json.dumps({"name": name, "machine": machine, "law": law.model_dump(mode="json")}, indent=1)
    Path(folder).mkdir(parents=True, exist_ok=True)
    write_all({str(Path(folder) / f"{name}.json"): (text + "\n").encode()})
    return name


def learned(folder: str) -> list[LearnedLaw]:
    """The laws of a library, by name; an absent folder gives an empty list. Raises ConfigError CC292, FileError."""
    out = []
    for path in sorted(Path(folder).glob("law_*.json")):
        try:
            data = json.loads(read_bytes(path))
            found = LearnedLaw(str(data["name"]), str(data["machine"]), Law.model_validate(data["law"]))
            for part, size in found.pieces():
                _placed(part, size)
        except (ValueError, KeyError, TypeError, StopIteration, ValidationError, FormulaError) as error:
            what = str(error).split("\n")[0]
            at = Location(display_name(str(path)), getattr(error, "lineno", 1), getattr(error, "colno", 1))
            raise ConfigError("CC292", f"no law of a library: {what}", at=at) from None
        out.append(found)
    return out
