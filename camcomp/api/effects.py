"""The effects that a machine file can name, and a diagnosis can find."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from camcomp.ground import shelf
from camcomp.model.effect import Parameter
from camcomp.model.signal_path import HOOKS

if TYPE_CHECKING:
    from camcomp.diagnosis.law.library import LearnedLaw


def described_effects(library: str | None = None) -> list[dict[str, Any]]:
    """All effects of the shelf and of entry points, in JSON types; library: a folder of laws found before."""
    out: list[dict[str, Any]] = []
    for name, effect in shelf.usable("effects"):
        if not effect.PARAMETERS:
            continue
        out.append({
            "effect": name,
            "stage": effect.STAGE,
            "target": _target(effect),
            "description": (effect.__doc__ or "").strip().split("\n")[0],
            "plain": getattr(effect, "PLAIN", ""),
            "remedy": getattr(effect, "REMEDY", ""),
            "source": effect.SOURCE,
            "hooks": [each for each in HOOKS if hasattr(effect, each)],
            "parameters": [_described(p) for p in effect.PARAMETERS],
        })  # fmt: skip
    if library is not None:
        from camcomp.diagnosis.law.library import learned

        out += [_described_law(each) for each in learned(library)]
    return out


def _described_law(law: LearnedLaw) -> dict[str, Any]:
    cause = law.candidate([each.target for each in law.law.parts if each.target is not None])
    effect = None if cause is None else cause.effect
    return {
        "effect": law.name, "stage": law.law.on, "target": None, "description": law.law.formula,
        "source": f"found on {law.machine}",
        "hooks": [each for each in HOOKS if hasattr(effect, each)],
        "parameters": [_described(p) for p in law.parameters],
    }  # fmt: skip


def _described(p: Parameter) -> dict[str, Any]:
    return {
        "name": p.name, "unit": p.unit, "nominal": p.nominal, "low": p.low, "high": p.high,
        "typical": p.scale, "tolerance": p.tolerance, "relative": p.log, "source": p.source,
    }  # fmt: skip


def _target(effect: Any) -> str | None:
    if effect.TARGET == "named":
        return " | ".join(effect.TARGETS)
    return {"actuator": "actuator", "machine": None, "either": "actuator or null"}[effect.TARGET]
