"""Forms that a law may take: functions of covariates with units, some with a shape (a period, a place, a length) to be found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from camcomp.diagnosis.law.sizes import Sizes
from camcomp.ground.datatypes import Floats
from camcomp.model.law.covariates import is_load, load_of

MOST_WAVES = 240  # periods of one covariate that are tried
LEAST_SPAN_MM = 2.0
_HARD_MM = 0.02  # a reversal that is over at once
_CENTRES, _MOMENTS = 13, 40
_LASTS = (0.5, 1.0, 2.0, 4.0, 8.0)  # s that something acts for


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
    bounds: tuple[tuple[float, float], ...] = ()

    @property
    def said(self) -> tuple[str, ...]:
        """The functions as a formula has them."""
        return tuple(text.format(*(f"{each:.6g}" for each in self.shape)) for text in self.texts)

    @property
    def passing(self) -> bool:
        """Whether it begins or ends at some moment."""
        return self.family in ("step", "while")

    def at(self, shape: Sequence[float] | Floats) -> Form:
        """The same with another shape, held within its bounds."""
        held = tuple(float(np.clip(v, low, high)) for v, (low, high) in zip(shape, self.bounds, strict=True))
        return replace(self, shape=held)


def _one(
    family: str, name: str, text: str, unit: str, *,
    shape: tuple[float, ...] = (), bounds: tuple[tuple[float, float], ...] = (),
) -> Form:  # fmt: skip
    """A form of one function of one covariate."""
    return Form(family=family, about=(name,), texts=(text,), units=(unit,), shape=shape, bounds=bounds)


def _waves(name: str, low: float, span: float, shortest: float) -> list[Form]:
    """Sines and cosines of one covariate; neighbours differ by a quarter of a turn over its span."""
    del low
    most = min(int(4.0 * span / shortest), MOST_WAVES)
    texts = (f"sin(2*pi*{name}/{{0}})", f"cos(2*pi*{name}/{{0}})")
    bounds = ((0.5 * shortest, 4.0 * span),)
    return [
        Form(family="wave", about=(name,), texts=texts, units=("", ""), shape=(4.0 * span / k,), bounds=bounds)
        for k in range(2, max(most, 2) + 1)
    ]


def _bumps(name: str, low: float, span: float) -> list[Form]:
    text, out = f"gauss(({name} - {{0}})/{{1}})", []
    for centre in np.linspace(low, low + span, _CENTRES):
        for width in (0.06 * span, 0.12 * span, 0.24 * span):
            bounds = ((low - 0.1 * span, low + 1.1 * span), (0.02 * span, 0.5 * span))
            out.append(_one("bump", name, text, "", shape=(float(centre), width), bounds=bounds))
    return out


def _powers(name: str, unit: str, most: int) -> list[Form]:
    return [
        _one("power" if k > 1 else "line", name, name if k == 1 else f"{name}^{k}", f"{unit}{k if k > 1 else ''}")
        for k in range(1, most + 1)
    ]


def _senses(name: str, span: float) -> list[Form]:
    """Forms of the sense of travel: at once, over a length, as lost motion, or decaying after a reversal."""
    out = []
    for length in (_HARD_MM, 0.02 * span, 0.06 * span, 0.18 * span):
        bounds = ((0.2 * _HARD_MM, 0.5 * span),)
        out.append(_one("sense", name, f"way({name}, {{0}})", "", shape=(length,), bounds=bounds))
    for width in (0.04 * span, 0.12 * span, 0.3 * span):
        out.append(
            _one("drag", name, f"drag({name}, {{0}})", "mm", shape=(width,), bounds=((0.005 * span, 0.8 * span),))
        )
    for length in (0.02 * span, 0.06 * span, 0.2 * span):
        text = f"way({name}, {_HARD_MM})*exp(-since({name})/{{0}})"
        out.append(_one("reversal", name, text, "", shape=(length,), bounds=((0.005 * span, 0.8 * span),)))
    return out


def _times(size: Sizes) -> list[Form]:
    """Forms of time and wear: drift, step, temporary offset, warm-up, slow oscillation."""
    low, high = size.limits["common_s"]
    span = max(high - low, 1e-9)
    out = _powers("common_s", "s", 2)
    for a, b in size.stretches:
        bounds = ((a, b),)
        for moment in np.linspace(a, b, max(_MOMENTS // len(size.stretches), 6))[1:-1]:
            out.append(_one("step", "common_s", "step(common_s - {0})", "", shape=(float(moment),), bounds=bounds))
            for last in _LASTS:
                text = "step(common_s - {0})*step({0} + {1} - common_s)"
                out.append(
                    _one("while", "common_s", text, "", shape=(float(moment), last), bounds=((a, b), (0.2, 30.0)))
                )
    out += [
        _one("step", "common_s", "step(common_s - {0})", "", shape=(a,), bounds=((low, high),))
        for a, _ in size.stretches[1:]
    ]
    out += [
        _one(
            "settling",
            "common_s",
            "exp(-common_s/{0})",
            "",
            shape=(share * span,),
            bounds=((0.01 * span, 10.0 * span),),
        )
        for share in (0.1, 0.3, 1.0)
    ]
    longest = max((b - a for a, b in size.stretches), default=span)
    periods = 1.0 / np.linspace(1.0 / (8.0 * longest), 1.0 / max(0.15 * longest, 1.0), 200)
    wave = ("sin(2*pi*common_s/{0})", "cos(2*pi*common_s/{0})")
    out += [
        Form(
            family="wave",
            about=("common_s",),
            texts=wave,
            units=("", ""),
            shape=(float(p),),
            bounds=((0.5, 4.0 * span),),
        )
        for p in periods
    ]
    if size.wide("cut_min"):
        out += _powers("cut_min", "min", 1)
        worn = size.limits["cut_min"][1]
        settled = "log(1 + cut_min/{0})"
        kinds: list[tuple[tuple[str, ...], ...]] = [(("cut_min",), (settled,), ("",))]
        if "force_N" in size.limits and size.wide("force_N"):  # creep follows the present force, too
            kinds.append((("cut_min", "force_N"), (settled, f"{settled}*force_N"), ("", "N")))
        for share in (0.02, 0.05, 0.2):
            bounds = ((1e-3 * worn, worn),)
            out += [
                Form(family="settling", about=about, texts=texts, units=units, shape=(share * worn,), bounds=bounds)
                for about, texts, units in kinds
            ]
    if size.wide("temp_C"):
        out.append(_one("line", "temp_C", "(temp_C - 20)", "K"))
        out.append(_one("power", "temp_C", "(temp_C - 20)^2", "K2"))
    return out


def at_tip(size: Sizes) -> list[Form]:
    """Forms of effects that move the tip."""
    out: list[Form] = []
    axes = [a for a in "xyz" if size.span(f"{a}_mm") > LEAST_SPAN_MM]
    for a in axes:
        name = f"{a}_mm"
        low, span = size.limits[name][0], size.span(name)
        out += _powers(name, "mm", 4) + _waves(name, low, span, max(3.0 * size.apart[name], span / 25.0))
        out += _bumps(name, low, span) + _senses(name, span)
        out.append(_one("rate", f"v{a}_mm_per_s", f"v{a}_mm_per_s", "mm/s"))
        out.append(_one("rate", f"v{a}_mm_per_s", f"v{a}_mm_per_s*abs(v{a}_mm_per_s)", "(mm/s)2"))
    for a, b in [(a, b) for a in axes for b in axes if a < b]:
        out.append(Form(family="product", about=(f"{a}_mm", f"{b}_mm"), texts=(f"{a}_mm*{b}_mm",), units=("mm2",)))
        out.append(Form(family="product", about=(f"{a}_mm", f"{b}_mm"), texts=(f"{a}_mm^2*{b}_mm",), units=("mm3",)))
        out.append(Form(family="product", about=(f"{a}_mm", f"{b}_mm"), texts=(f"{a}_mm*{b}_mm^2",), units=("mm3",)))
    if size.wide("feed_mm_per_s"):
        out += [_one("rate", "feed_mm_per_s", "feed_mm_per_s", "mm/s")]
        out += [_one("rate", "feed_mm_per_s", "feed_mm_per_s^2", "(mm/s)2")]
    if len(axes) > 1:
        for k in range(1, 5):
            angle = "heading_rad" if k == 1 else f"{k}*heading_rad"
            texts = f"sin({angle})", f"cos({angle})"
            out.append(Form(family=f"heading {k}", about=("heading_rad",), texts=texts, units=("", "")))
            while_moving = tuple(f"moving*{text}" for text in texts)
            out.append(Form(family=f"heading {k}", about=("heading_rad", "moving"), texts=while_moving, units=("", "")))
    for f in [f"f{a}_N" for a in "xyz" if size.wide(f"f{a}_N")]:
        out.append(_one("force", f, f, "N"))
        out.append(_one("force squared", f, f"{f}*abs({f})", "N2"))
        out += [
            Form(family="force by place", about=(f, f"{a}_mm"), texts=(f"{f}*{a}_mm",), units=("N mm",)) for a in axes
        ]
    return out + _times(size)


def at_drive(size: Sizes, revolute: bool) -> list[Form]:
    """Forms of effects that shift an actuator."""
    unit = "rad" if revolute else "mm"
    name = f"act_{unit}"
    low, span = size.limits[name][0], size.span(name)
    if span < (1e-3 if revolute else LEAST_SPAN_MM):
        return _times(size)
    shortest = max(3.0 * size.apart[name], span / 40.0)
    out = _powers(name, unit, 3) + _waves(name, low, span, shortest) + _bumps(name, low, span) + _senses(name, span)
    speed = f"{name}_per_s"
    for text, of in ((speed, f"{unit}/s"), (f"abs({speed})", f"{unit}/s"), (f"{speed}*abs({speed})", f"({unit}/s)2")):
        out.append(_one("rate", speed, text, of))
    out.append(_one("acceleration", f"{speed}2", f"{speed}2", f"{unit}/s2"))
    return out + _loads(size) + _times(size)


def _loads(size: Sizes) -> list[Form]:
    """Forms of drive loads: powers of the own load beyond the linear spring; any form of the loads of other drives."""
    out = []
    for name in [each for each in size.limits if is_load(each) and size.wide(each)]:
        unit = "N" if name.endswith("N") else "N mm"
        square, cube = (f"({unit}){k}" if " " in unit else f"{unit}{k}" for k in (2, 3))
        if load_of(name) is not None:
            out.append(_one("force", name, name, unit))
        out.append(_one("force squared", name, f"{name}*abs({name})", square))
        out += [_one("force power", name, f"{name}^{k}", per) for k, per in ((2, square), (3, cube))]
    return out
