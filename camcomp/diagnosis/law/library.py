"""Laws that were found before: a folder of them, offered as candidates for the next machine.

Every term of a law has its own factor on the next machine, so that a wave may have another phase there; periods, places and
lengths stay.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from pydantic import ValidationError

from camcomp.diagnosis.fit.bench import CandidateCause
from camcomp.diagnosis.law.describe import where_of
from camcomp.diagnosis.result.types import Law, LawPart
from camcomp.ground import shelf
from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError, Location
from camcomp.ground.files import display_name, read_bytes, write_all
from camcomp.model.effect import Parameter
from camcomp.model.law.covariates import load_of
from camcomp.model.law.expression import FormulaError
from camcomp.model.law.law import AT_DRIVES, EmpiricalLaw
from camcomp.model.law.spec import FormulaSpec, MapSpec
from camcomp.model.signal_path import ORDER

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
        which = [np.array([a == part.target for a in actuators], float) for part, _ in pieces]
        placed = [_Piece(p.name, law, own) for p, law, own in zip(self.parameters, laws, which, strict=True)]
        effect = SimpleNamespace(
            TARGET="machine", SOURCE=_SOURCE, STAGE=self.law.on, PARAMETERS=self.parameters, __doc__=self.law.says
        )
        formula = shelf.load("effects", "formula")
        for stage in dict.fromkeys(law.on if law.on in AT_DRIVES else "workpiece" for law in laws):
            for hook in (each for each in dict(ORDER)[stage] if hasattr(formula, each)):
                setattr(effect, hook, partial(_in_turn, getattr(formula, hook), stage in AT_DRIVES, placed))
        return CandidateCause(self.name, None, effect)

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


@dataclass(frozen=True, eq=False)
class _Piece:
    """A term at work: its factor's name, the law, and which actuators (m,) it moves."""

    factor: str
    law: EmpiricalLaw
    which: Floats


def _in_turn(
    hook: Callable[..., Floats], at_drives: bool, pieces: Sequence[_Piece], values: Floats, *given: Any
) -> Floats:
    """Values of a hook of the effect `formula`, of the pieces one after the other, each as large as its factor."""
    *others, p = given
    for each in pieces:
        if p[each.factor] != 0.0:
            own = [others[0], each.which] if at_drives else others
            values = hook(values, *own, {"law": replace(each.law, factor=p[each.factor] * each.law.factor)})
    return values


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
