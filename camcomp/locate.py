"""The gap of every run as the place-finding engines want it, and what they find: sizes, directions, periods, places."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from camcomp.bench import thinned
from camcomp.columns import RUN_OFFSET_MM
from camcomp.datatypes import Floats
from camcomp.gap import where
from camcomp.gap.cycles import Line, frequencies, screws
from camcomp.gap.effect import Cause
from camcomp.gap.search import Fitted
from camcomp.gap.whiten import effective_rows
from camcomp.inquiry import Inquiry


def main_channels(inquiry: Inquiry) -> slice:
    """The channels in which the gap is stated: the tip, or else the encoders, or else the drive forces."""
    m = len(inquiry.bench.actuators)
    for part in (slice(0, 3), slice(3, 3 + m), slice(3 + m, 3 + 2 * m)):
        if any(np.isfinite(r[:, part]).any() for r in inquiry.residuals):
            return part
    return slice(3 + 2 * m, 6 + 2 * m)


def gap_sizes(inquiry: Inquiry, causes: Sequence[Cause] = ()) -> Floats:
    """Length (n,), um, of what causes leave of the gap, at all rows of all runs where it is known."""
    part = main_channels(inquiry)
    gaps = [inquiry.bench.gap(k, causes)[:, part] for k in range(len(inquiry.residuals))]
    # an axis that nobody measured is no reason to do without the others
    size = np.concatenate([np.where(np.isfinite(g).any(axis=1), np.sqrt(np.nansum(g**2, axis=1)), np.nan) for g in _together(gaps)])
    return np.asarray(size[np.isfinite(size)] * 1e3)


def gap_of(inquiry: Inquiry) -> dict[str, float]:
    """Size of the gap over all runs, and of its noise, um."""
    part, size = main_channels(inquiry), gap_sizes(inquiry)
    repeats = RUN_OFFSET_MM if part.start == 0 else 0.0  # what one run differs from the next belongs to the floor
    seen = np.isfinite(inquiry.noise.sigma[:, part])
    sigma = np.where(seen, inquiry.noise.sigma[:, part] ** 2, 0.0).sum(axis=0) / np.maximum(seen.sum(axis=0), 1)
    if part.start == 0:
        sigma = sigma - inquiry.background.colour().excess ** 2
    noise = np.sqrt(np.sum(np.maximum(sigma, 0.0) + repeats**2, where=seen.any(axis=0))) * 1e3
    return {
        "rms_um": round(float(np.sqrt(np.mean(size**2))), 3),
        "p95_um": round(float(np.quantile(size, 0.95)), 3),
        "max_um": round(float(size.max()), 3),
        "noise_floor_um": round(float(noise), 3),
    }


def _together(gaps: list[Floats]) -> list[Floats]:
    """Gaps with rows blanked where a channel that the run has is missing."""
    out = []
    for g in gaps:
        known = np.isfinite(g)
        whole = np.all(known | ~np.any(known, axis=0), axis=1)
        out.append(np.where(np.reshape(whole, (-1, 1)), g, np.nan))
    return out


def run_gaps(inquiry: Inquiry) -> list[where.RunGap]:
    """Every run's gap in the main channels, with where the machine was and how it moved."""
    part = main_channels(inquiry)
    m = len(inquiry.bench.actuators)
    out = []
    for k, run in enumerate(inquiry.bench.runs):
        gap = inquiry.bench.gap(k)[:, part]
        noise = inquiry.noise.sigma[k, part]
        if part.start == 0:  # what no sensor makes belongs to the gap
            found = inquiry.background.colour()
            noise = np.where(found.excess > 0, np.minimum(noise, found.floor), noise)
        thin = float(np.mean([1.0 / effective_rows(inquiry.noise, c, 1) for c in range(part.start, part.stop)]))
        line = thinned(run.measured.line[:, None], run.thin)[:, 0]
        if part.start == 0:
            slope = thinned(inquiry.bench.row_slopes(k).reshape(-1, 3 * m), run.thin).reshape(-1, 3, m)
            clean = np.where(np.isfinite(gap), gap, 0.0)
            drives = np.einsum("nij,nj->ni", np.linalg.pinv(slope), clean)
        else:
            drives = gap if gap.shape[1] == m else np.zeros((len(gap), m))
        motion = inquiry.bench.nominal[k].motion
        tip, position, direction = (thinned(v, run.thin) for v in (inquiry.bench.nominal[k].tip, motion.encoder, motion.direction))
        noise = np.where(np.isfinite(noise), np.hypot(noise, RUN_OFFSET_MM if part.start == 0 else 0.0), 1.0)
        out.append(where.RunGap(run.name, gap, noise, thin, inquiry.times[k], line, drives, tip, position, direction))
    return out


def rest_by_actuator(inquiry: Inquiry, f: Fitted, kind: str) -> dict[str, float]:
    """Energy that a set leaves in one kind of channel by actuator, as shares; that of the tip read as motion of the carriages."""
    names = inquiry.bench.actuators
    m = len(names)
    energy = np.zeros(m)
    causes = inquiry.causes(f.members, f.theta, f.extra)
    for k, run in enumerate(inquiry.bench.runs):
        rest = inquiry.bench.difference(k, inquiry.bench.read(k, causes))
        rest = np.where(np.isfinite(rest), rest, 0.0)
        if kind == "tip":
            slope = thinned(inquiry.bench.row_slopes(k).reshape(-1, 3 * m), run.thin).reshape(-1, 3, m)
            rest = np.einsum("nij,nj->ni", np.linalg.pinv(slope), rest[:, :3])
        elif kind in ("encoder", "drive"):
            rest = rest[:, 3:][:, :m] if kind == "encoder" else rest[:, 3 + m :][:, :m]
        else:
            return {}
        energy += np.sum(rest**2, axis=0)
    return where.shares(dict(zip(names, energy.tolist(), strict=True)))


def channel_axes(inquiry: Inquiry) -> list[str]:
    """Names of the main channels: x, y, z of the tip, or the actuators."""
    return ["x", "y", "z"] if main_channels(inquiry).start == 0 else list(inquiry.bench.actuators)


def patterns_of(inquiry: Inquiry, gaps: list[where.RunGap]) -> dict[str, Any]:
    """What the gap does with the direction of travel, the turns of the screws, time, and the place in the workspace."""
    actuators = inquiry.bench.actuators
    return {
        "travel": where.travel(gaps, actuators),
        "screws": [_line(each, "actuator", "period_mm") for each in screws(gaps, actuators)],
        "frequencies": [_line(each, "axis", "hertz") for each in frequencies(gaps, channel_axes(inquiry))],
        "places": where.places(gaps),
    }


def _line(line: Line, whose: str, at: str) -> dict[str, Any]:
    size = round(1e3 * line.amplitude, 3)
    return {whose: line.name, at: round(line.at, 4), "amplitude_um": size, "share": round(line.share, 4)}
