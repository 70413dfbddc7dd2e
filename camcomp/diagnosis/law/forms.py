"""Forms that a law may take: functions of covariates with units, some with a shape (a period, a place, a length) to be found."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from camcomp.diagnosis.model.discrepancy import ORDERS
from camcomp.ground.datatypes import Floats
from camcomp.model.law.covariates import is_load, load_of

MOST_WAVES = 240  # periods of one covariate that are tried
HARD_MM = 0.02  # a reversal that is over at once
_CENTRES, _MOMENTS = 13, 40
_LASTS = (0.5, 1.0, 2.0, 4.0, 8.0)  # s that something acts for
_MAPPED = ("x_mm", "y_mm", "z_mm", "heading_rad", "temp_C", "cut_min", "fx_N", "fy_N", "fz_N")  # alone in a map
Bounds = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Sizes:
    """limits: covariate -> (low, high) over all runs; apart: how far neighbouring rows usually are; stretches: (s, s) in
    which runs were logged, on the common clock.
    """

    limits: dict[str, tuple[float, float]]
    apart: dict[str, float]
    stretches: tuple[tuple[float, float], ...]

    def span(self, name: str) -> float:
        """High minus low."""
        low, high = self.limits[name]
        return high - low

    def wide(self, name: str) -> bool:
        """Whether it varies at all."""
        low, high = self.limits[name]
        return high - low > max(1e-6, 1e-3 * max(abs(low), abs(high)))


def sizes(rows: Sequence[Mapping[str, Floats]]) -> Sizes:
    """Reach of every covariate."""
    limits, apart = {}, {}
    for name in rows[0]:
        every = [each[name] for each in rows]
        limits[name] = (min(float(v.min()) for v in every), max(float(v.max()) for v in every))
        steps: Floats = np.concatenate([np.abs(np.diff(v)) for v in every])
        apart[name] = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    stretches = tuple((float(each["common_s"][0]), float(each["common_s"][-1])) for each in rows)
    return Sizes(limits, apart, tuple(sorted(stretches)))


@dataclass(frozen=True, kw_only=True)
class Form:
    """texts: one or two functions that belong together, with {0}, {1} for the shape; units of their coefficients per mm.

    bounds: of every number of the shape; family: what kind of law it is; about: the covariates.
    """

    family: str
    about: tuple[str, ...]
    texts: tuple[str, ...]
    units: tuple[str, ...]
    shape: tuple[float, ...] = ()
    bounds: Bounds = ()

    @property
    def said(self) -> tuple[str, ...]:
        """The functions as a formula has them."""
        return tuple(text.format(*(f"{each:.6g}" for each in self.shape)) for text in self.texts)

    @property
    def size(self) -> int:
        """How many functions."""
        return len(self.texts)

    @property
    def passing(self) -> bool:
        """Whether it begins or ends at some moment."""
        return self.family in ("step", "while")

    def at(self, shape: Sequence[float] | Floats) -> Form:
        """The same with another shape, held within its bounds."""
        held = tuple(float(np.clip(v, low, high)) for v, (low, high) in zip(shape, self.bounds, strict=True))
        return replace(self, shape=held)


@dataclass(frozen=True, kw_only=True)
class SmoothForm:
    """A smooth map: cubic splines over one or two covariates, `counts` of each within its limits."""

    about: tuple[str, ...]
    limits: Bounds
    counts: tuple[int, ...]
    family: str = "map"
    shape: tuple[float, ...] = ()

    @property
    def size(self) -> int:
        """How many functions."""
        return int(np.prod(self.counts))

    @property
    def passing(self) -> bool:
        """It never begins or ends at some moment."""
        return False


def _one(
    family: str, name: str, text: str, unit: str = "", shape: tuple[float, ...] = (), *, bounds: Bounds = ()
) -> Form:
    """A form of one function of one covariate."""
    return Form(family=family, about=(name,), texts=(text,), units=(unit,), shape=shape, bounds=bounds)


def _wave(name: str, period: float, low: float, high: float) -> Form:
    texts = (f"sin(2*pi*{name}/{{0}})", f"cos(2*pi*{name}/{{0}})")
    return Form(family="wave", about=(name,), texts=texts, units=("", ""), shape=(period,), bounds=((low, high),))


def _waves(name: str, span: float, shortest: float) -> Iterator[Form]:
    """Sines and cosines of one covariate; neighbours differ by a quarter of a turn over its span."""
    most = min(int(4.0 * span / shortest), MOST_WAVES)
    return (_wave(name, 4.0 * span / k, 0.5 * shortest, 4.0 * span) for k in range(2, max(most, 2) + 1))


def _bumps(name: str, low: float, span: float) -> Iterator[Form]:
    bounds = ((low - 0.1 * span, low + 1.1 * span), (0.02 * span, 0.5 * span))
    for centre in np.linspace(low, low + span, _CENTRES):
        for width in (0.06 * span, 0.12 * span, 0.24 * span):
            yield _one("bump", name, f"gauss(({name} - {{0}})/{{1}})", "", (float(centre), width), bounds=bounds)


def _powers(name: str, unit: str, most: int) -> Iterator[Form]:
    yield _one("line", name, name, unit)
    for k in range(2, most + 1):
        yield _one("power", name, f"{name}^{k}", f"{unit}{k}")


def _senses(name: str, span: float) -> Iterator[Form]:
    """Forms of the sense of travel: at once, over a length, as lost motion, or decaying after a reversal."""
    kinds: list[tuple[str, str, str, tuple[float, ...], tuple[float, float]]] = [
        ("sense", f"way({name}, {{0}})", "", (0.02, 0.06, 0.18), (0.2 * HARD_MM, 0.5 * span)),
        ("drag", f"drag({name}, {{0}})", "mm", (0.04, 0.12, 0.3), (0.005 * span, 0.8 * span)),
        ("reversal", f"way({name}, {HARD_MM})*exp(-since({name})/{{0}})", "", (0.02, 0.06, 0.2), (0.005 * span, 0.8 * span)),
    ]  # fmt: skip
    yield _one("sense", name, f"way({name}, {{0}})", "", (HARD_MM,), bounds=(kinds[0][4],))
    for family, text, unit, shares, bounds in kinds:
        for share in shares:
            yield _one(family, name, text, unit, (share * span,), bounds=(bounds,))


def _times(size: Sizes) -> Iterator[Form]:
    """Forms of time and wear: drift, step, temporary offset, warm-up, slow oscillation."""
    low, high = size.limits["common_s"]
    span, name = max(high - low, 1e-9), "common_s"
    yield from _powers(name, "s", 2)
    step, during = "step(common_s - {0})", "step(common_s - {0})*step({1} - common_s)"
    for a, b in size.stretches:
        for moment in np.linspace(a, b, max(_MOMENTS // len(size.stretches), 6))[1:-1]:
            yield _one("step", name, step, "", (float(moment),), bounds=((a, b),))
            for last in _LASTS:
                yield _one("while", name, during, "", (float(moment), min(moment + last, b)), bounds=((a, b), (a, b)))
    for a, _ in size.stretches[1:]:
        yield _one("step", name, step, "", (a,), bounds=((low, high),))
    for share in (0.1, 0.3, 1.0):
        yield _one("settling", name, "exp(-common_s/{0})", "", (share * span,), bounds=((0.01 * span, 10.0 * span),))
    longest = max((b - a for a, b in size.stretches), default=span)
    for turns in np.linspace(1.0 / (8.0 * longest), 1.0 / max(0.15 * longest, 1.0), 200):
        yield _wave(name, float(1.0 / turns), 0.5, 4.0 * span)
    if size.wide("cut_min"):
        yield from _powers("cut_min", "min", 1)
        worn, settled = size.limits["cut_min"][1], "log(1 + cut_min/{0})"
        under_load = "force_N" in size.limits and size.wide("force_N")  # creep follows the present force, too
        for share in (0.02, 0.05, 0.2):
            alone = _one("settling", "cut_min", settled, "", (share * worn,), bounds=((1e-3 * worn, worn),))
            yield alone
            if under_load:
                texts = (settled, f"{settled}*force_N")
                yield replace(alone, about=("cut_min", "force_N"), texts=texts, units=("", "N"))
    if size.wide("temp_C"):
        yield _one("line", "temp_C", "(temp_C - 20)", "K")
        yield _one("power", "temp_C", "(temp_C - 20)^2", "K2")


def at_tip(size: Sizes) -> list[Form]:
    """Forms of effects that move the tip."""
    out: list[Form] = []
    axes = [f"{a}_mm" for a in "xyz" if size.wide(f"{a}_mm")]
    for name in axes:
        low, span, speed = size.limits[name][0], size.span(name), f"v{name}_per_s"
        out += [*_powers(name, "mm", 4), *_waves(name, span, max(3.0 * size.apart[name], span / 25.0))]
        out += [*_bumps(name, low, span), *_senses(name, span)]
        out += [_one("rate", speed, speed, "mm/s"), _one("rate", speed, f"{speed}*abs({speed})", "(mm/s)2")]
    for a, b in combinations(axes, 2):
        for text, unit in ((f"{a}*{b}", "mm2"), (f"{a}^2*{b}", "mm3"), (f"{a}*{b}^2", "mm3")):
            out.append(Form(family="product", about=(a, b), texts=(text,), units=(unit,)))
    if size.wide("feed_mm_per_s"):
        feed = "feed_mm_per_s"
        out += [_one("rate", feed, feed, "mm/s"), _one("rate", feed, f"{feed}^2", "(mm/s)2")]
    if len(axes) > 1:
        for k in range(1, 5):
            angle = "heading_rad" if k == 1 else f"{k}*heading_rad"
            turn = Form(
                family=f"heading {k}", about=("heading_rad",), texts=(f"sin({angle})", f"cos({angle})"), units=("", "")
            )
            moving = tuple(f"moving*{text}" for text in turn.texts)
            out += [turn, replace(turn, about=("heading_rad", "moving"), texts=moving)]
    for f in [f"f{a}_N" for a in "xyz" if size.wide(f"f{a}_N")]:
        out += [_one("force", f, f, "N"), _one("force squared", f, f"{f}*abs({f})", "N2")]
        out += [Form(family="force by place", about=(f, a), texts=(f"{f}*{a}",), units=("N mm",)) for a in axes]
    return [*out, *_times(size)]


def at_drive(size: Sizes, revolute: bool) -> list[Form]:
    """Forms of effects that shift an actuator."""
    unit = "rad" if revolute else "mm"
    name, speed = f"act_{unit}", f"act_{unit}_per_s"
    low, span = size.limits[name][0], size.span(name)
    if not size.wide(name):
        return list(_times(size))
    out = [*_powers(name, unit, 3), *_waves(name, span, max(3.0 * size.apart[name], span / 40.0))]
    out += [*_bumps(name, low, span), *_senses(name, span)]
    for text, of in ((speed, f"{unit}/s"), (f"abs({speed})", f"{unit}/s"), (f"{speed}*abs({speed})", f"({unit}/s)2")):
        out.append(_one("rate", speed, text, of))
    out.append(_one("acceleration", f"{speed}2", f"{speed}2", f"{unit}/s2"))
    return [*out, *_loads(size), *_times(size)]


def _loads(size: Sizes) -> Iterator[Form]:
    """Forms of drive loads: powers of the own load beyond the linear spring; any form of the loads of other drives."""
    for name in [each for each in size.limits if is_load(each) and size.wide(each)]:
        unit = "N" if name.endswith("N") else "N mm"
        square, cube = (f"({unit}){k}" if " " in unit else f"{unit}{k}" for k in (2, 3))
        if load_of(name) is not None:
            yield _one("force", name, name, unit)
        yield _one("force squared", name, f"{name}*abs({name})", square)
        yield from (_one("force power", name, f"{name}^{k}", per) for k, per in ((2, square), (3, cube)))


def smooth_forms(size: Sizes, *, at_tip: bool) -> list[SmoothForm]:
    """Maps over one or two covariates, of the tip or of an actuator."""
    pairs = list(combinations([f"{a}_mm" for a in "xyz" if size.wide(f"{a}_mm")], 2)) if at_tip else []
    single = [(name,) for name in (_MAPPED if at_tip else ("act_mm",)) if size.wide(name)]
    return [
        SmoothForm(
            about=names, limits=tuple(size.limits[n] for n in names), counts=(2 * ORDERS // len(names),) * len(names)
        )
        for names in (*pairs, *single)
    ]
