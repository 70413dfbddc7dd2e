"""History of a machine: values, course and next measurement of every parameter found so far."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import date, timedelta
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from camcomp.diagnosis.history.drift import Course, course_of, days_until, drift_bound
from camcomp.diagnosis.history.folder import Kept
from camcomp.ground.result import Result


class DatedValue(Result):
    """A parameter as one diagnosis found it."""

    day: date
    value: float
    ci95: tuple[float, float]


class ParameterCourse(Result):
    """A parameter over the days."""

    effect: str
    target: str | None
    parameter: str
    values: tuple[DatedValue, ...]
    course: Literal["steady", "drift", "jumps", "too few"]
    level: Annotated[float, Field(description="at the last day")]
    rate_per_year: float
    rate_ci95: tuple[float, float]
    changed: Annotated[tuple[date, ...], Field(description="first days after a jump")]
    measure_again: Annotated[date | None, Field(description="null where its size at the tip is not known")]


class DatedVerdict(Result):
    """Verdict of one diagnosis, with its day."""

    day: date
    verdict: Literal["none", "identified", "ambiguous", "unknown"]
    gap_rms_um: float
    floor_um: float | None
    causes: tuple[str, ...]


class StandardCourse(Result):
    """A value of an acceptance test over the days: of one line of an axis, one circle, or one pose of an arm."""

    standard: Literal["ISO 230-2", "ISO 230-4", "ISO 9283"]
    name: str
    place: str
    values: Annotated[tuple[tuple[date, float], ...], Field(description="um")]


class Chronicle(Result):
    """The history of a machine."""

    verdicts: tuple[DatedVerdict, ...]
    parameters: tuple[ParameterCourse, ...]
    measure_again: Annotated[date | None, Field(description="the earliest of those of the parameters")]
    standards: tuple[StandardCourse, ...] = ()


def chronicle_of(kept: Sequence[Kept], tolerance_um: float) -> Chronicle:
    """The history of diagnoses in order; tolerance_um: allowed drift of the tip since the last one, um."""
    found: dict[tuple[str, str | None, str], list[tuple[Kept, Any, float]]] = {}
    for each in kept:
        gap = each.result.gap
        for cause in each.result.known:
            size = (cause.share * max(gap.rms_um**2 - (gap.noise_floor_um or 0.0) ** 2, 0.0)) ** 0.5
            for name, estimate in cause.parameters.items():
                found.setdefault((cause.effect, cause.target, name), []).append((each, estimate, size))
    courses = [_course(key, rows, tolerance_um) for key, rows in found.items()]
    due = [each.measure_again for each in courses if each.measure_again is not None]
    return Chronicle(
        verdicts=tuple(_verdict(each) for each in kept),
        parameters=tuple(courses),
        measure_again=min(due, default=None),
        standards=tuple(_standards(kept)),
    )


def _standards(kept: Sequence[Kept]) -> Iterator[StandardCourse]:
    """Values of acceptance tests by name and position, in order of first occurrence."""
    found: dict[tuple[Any, str, str], list[tuple[date, float]]] = {}
    for each in kept:
        held = each.result.standards
        rows: list[tuple[str, str, Result]] = [("ISO 230-2", f"{a.axis} at {a.line}", a) for a in held.positioning]
        for test in held.circles:
            place = f"{test.circle}, {'cutting' if test.cutting else 'in air'}"
            rows.append(("ISO 230-4", place, test))
            rows += [("ISO 230-4", f"{place}, {turn.direction}", turn) for turn in test.turns]
        rows += [("ISO 9283", f"{p.campaign} {p.pose}", p) for p in held.poses]
        for standard, place, row in rows:
            for name, value in row:
                if name.endswith("_um") and value is not None:
                    found.setdefault((standard, name.removesuffix("_um"), place), []).append((each.day, value))
    for (standard, name, place), values in found.items():
        yield StandardCourse(standard=standard, name=name, place=place, values=tuple(values))


def _verdict(kept: Kept) -> DatedVerdict:
    result = kept.result
    return DatedVerdict(
        day=kept.day, verdict=result.verdict, gap_rms_um=result.gap.rms_um, floor_um=result.gap.noise_floor_um,
        causes=tuple(each.label for each in result.causes),
    )  # fmt: skip


def _course(
    key: tuple[str, str | None, str], rows: Sequence[tuple[Kept, Any, float]], tolerance_um: float
) -> ParameterCourse:
    effect, target, name = key
    days = np.array([kept.day.toordinal() for kept, _, _ in rows], float)
    values = np.array([each.value for _, each, _ in rows])
    deviations = np.array([max(each.ci95[1] - each.ci95[0], 0.0) / (2.0 * 1.96) for _, each, _ in rows])
    deviations = np.maximum(deviations, 1e-9 * max(float(np.abs(values).max()), 1e-300))
    course = course_of(days, values, deviations)
    return ParameterCourse(
        effect=effect,
        target=target,
        parameter=name,
        values=tuple(
            DatedValue(day=kept.day, value=each.value, ci95=each.ci95) for kept, each, _ in rows
        ),
        course=course.kind,
        level=course.level,
        rate_per_year=365.25 * course.rate,
        rate_ci95=(365.25 * (course.rate - 1.96 * course.rate_sd), 365.25 * (course.rate + 1.96 * course.rate_sd)),
        changed=tuple(rows[k][0].day for k in course.jumps),
        measure_again=_due(course, days, deviations, rows, tolerance_um),
    )  # fmt: skip


def _due(
    course: Course,
    days: np.ndarray,
    deviations: np.ndarray,
    rows: Sequence[tuple[Kept, Any, float]],
    tolerance_um: float,
) -> date | None:
    """The day on which the effect of the parameter at the tip may have changed by more than the tolerance."""
    last, estimate, size = rows[-1]
    if not size > 0.0 or not abs(estimate.value) > 0.0:
        return None
    limit = tolerance_um * abs(estimate.value) / size  # its share at the tip grows with its value
    if course.kind != "drift":
        since = slice(course.jumps[-1] if course.jumps else 0, None)
        bound = drift_bound(days[since], deviations[since])
        if bound == 0.0:  # one measurement does not predict
            return None
        course = replace(course, rate_sd=bound)
    return last.day + timedelta(days=int(days_until(course, limit)))
