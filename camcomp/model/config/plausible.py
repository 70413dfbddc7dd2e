"""Warnings about allowed but implausible values: wrong units, wrong signs, missing keys."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from camcomp.model.config.doubt import Doubt
from camcomp.model.config.links import Spring
from camcomp.model.config.robot import LinkSpec, ParallelogramSpec, PrismaticActuator, RevoluteActuator
from camcomp.model.config.spec import Config

# Stiffness of drives, from screws with their bearings to gears of heavy arms; confused units differ by 1000.
USUAL_N_PER_MM = (100.0, 3.0e6)
USUAL_NMM_PER_RAD = (3.0e6, 1.0e12)
# Translational over rotational compliance of a part is a length squared: a few mm to some metres.
SHORTEST_LEVER_MM = 1.0


def doubts(config: Config) -> list[Doubt]:
    """Implausible values of a machine file."""
    return [*config.doubts, *_drives(config), *_links(config), *_process(config), *_tool(config)]


def _drives(config: Config) -> Iterator[Doubt]:
    for name, chain in config.robot.chains.items():
        for i, each in enumerate(chain.elements):
            if not isinstance(each, PrismaticActuator | RevoluteActuator) or each.stiffness is None:
                continue
            key, unit, usual, other = (
                ("stiffness_Nmm_per_rad", "N mm/rad", USUAL_NMM_PER_RAD, "N m/rad")
                if each.rotary
                else ("stiffness_N_per_mm", "N/mm", USUAL_N_PER_MM, "N/um or N/m")
            )
            low, high = usual
            if not low <= each.stiffness <= high:
                size = "stiff" if each.stiffness > high else "soft"
                text = (
                    f"the drive of {each.name or name} is unusually {size}: {each.stiffness:g} {unit}, where drives have "
                    f"{low:g} to {high:g}; is the value in {other}?"
                )
                yield Doubt(text, config.at("robot", "chains", name, "elements", i, key))


def _links(config: Config) -> Iterator[Doubt]:
    for name, chain in config.robot.chains.items():
        for i, each in enumerate(chain.elements):
            spring = each.bar if isinstance(each, ParallelogramSpec) else each if isinstance(each, LinkSpec) else None
            lever = None if spring is None else _lever_mm(spring)
            if lever is not None and lever < SHORTEST_LEVER_MM:
                text = (
                    f"a link of chain {name} gives way in turning as if its levers were {lever:.2g} mm long; are its values in "
                    "m and N m instead of mm and N mm?"
                )
                yield Doubt(text, config.at("robot", "chains", name, "elements", i))


def _lever_mm(spring: Spring) -> float | None:
    """Square root of translational over rotational compliance, mm; None for beams and springs that have only one of them."""
    if spring.compliance is not None:
        values = np.diag(np.asarray(spring.compliance, float))
    elif spring.compliance_diagonal is not None:
        given = spring.compliance_diagonal
        values = np.array([*given.translation_mm_per_N, *given.rotation_rad_per_Nmm])
    elif spring.stiffness is not None:
        values = 1.0 / np.diag(np.asarray(spring.stiffness, float))
    elif spring.stiffness_diagonal is not None:
        stiff = spring.stiffness_diagonal
        values = 1.0 / np.array([*stiff.translation_N_per_mm, *stiff.rotation_Nmm_per_rad])
    else:
        return None
    moved, turned = (_middle(each) for each in (values[:3], values[3:]))
    return None if moved is None or turned is None else float(np.sqrt(moved / turned))


def _middle(values: Sequence[float] | np.ndarray) -> float | None:
    elastic = np.asarray([each for each in values if each > 0.0])
    return float(np.exp(np.mean(np.log(elastic)))) if len(elastic) else None


def _process(config: Config) -> Iterator[Doubt]:
    force = config.process.force
    along = getattr(force.params, "Ft_N", 0.0) if force.model == "constant" else 0.0
    if along > 0.0:
        text = (
            f"Ft_N: {along:g} pulls the tool along its feed; a cut holds it back (negative) but for climb milling with a large "
            "width of cut"
        )
        yield Doubt(text, config.at("process", "force", "Ft_N"))


def _tool(config: Config) -> Iterator[Doubt]:
    tool, cuts = config.tool, config.process.force.model != "none"
    if cuts and tool.length_mm is None and tool.vector_mm is None:
        text = (
            "the tool has no length, so its tip counts as the platform reference; say length_mm: 0 where that is meant"
        )
        yield Doubt(text, config.at("tool"))
