"""What labelled clocks and clampings differ by, found before anything is asked about causes."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from camcomp.diagnosis.fit.bench import Bench, CandidateCause, Run
from camcomp.diagnosis.fit.columns import CLOCK_JITTER_S, Columns
from camcomp.diagnosis.fit.labels import EFFECT_OF, apart, label_name, scatter
from camcomp.diagnosis.statistics.noise_model import weighted_median
from camcomp.ground import shelf
from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Cause
from camcomp.model.motion.twin import Twin

PASSES = 5
STEP_S = 1e-4  # in which a tip moves in one direction


def with_clocks(twin: Twin, runs: Sequence[Run]) -> list[Run]:
    """The runs with what their labelled clocks differ by taken up: milliseconds are too much for columns that are straight."""
    seen = [
        k for k, run in enumerate(runs) if run.measured.has("tip") and not run.run_path.led and run.run_path.ordered
    ]
    labels = {k: runs[k].clock for k in seen}
    found = {
        each: _offset(twin, [runs[k] for k in seen if labels[k] == each]) for each in dict.fromkeys(labels.values())
    }
    common = found[None] if None in found else float(np.mean(list(found.values()))) if found else 0.0
    out = list(runs)
    for k in seen:
        late = found[labels[k]]
        out[k] = replace(runs[k], run_path=replace(runs[k].run_path, clock_s=late - common, between_s=abs(late)))
    return out


def _offset(twin: Twin, runs: Sequence[Run]) -> float:
    """Clock offset, s, of runs of one label: the weighted median over rows, which neither outliers nor other errors lead far."""
    clock, offset = shelf.load("effects", "time_sync"), 0.0
    solved = [twin.sense(run.run_path)[1] for run in runs]
    for _ in range(PASSES):
        late, speed = [], []
        for run, known in zip(runs, solved, strict=True):
            now, later = (
                twin.sense(run.run_path, [Cause("time_sync", clock, None, {"offset_s": offset + step})], solved=known)[
                    0
                ].tip
                for step in (STEP_S, -STEP_S)
            )
            velocity = (later - now) / (2.0 * STEP_S)
            v = np.linalg.norm(velocity, axis=1)
            ahead = np.sum((run.measured.tip - 0.5 * (now + later)) * velocity, axis=1)
            use = np.isfinite(ahead) & (v > 0.0)
            late.append(-ahead[use] / v[use] ** 2)
            speed.append(v[use])
        change = weighted_median(np.concatenate(late), np.concatenate(speed))
        offset += change
        if abs(change) < CLOCK_JITTER_S:
            break
    return offset


def with_scatter(columns: Columns, bench: Bench, amplitude: Floats) -> Columns:
    """The columns with the tolerance of labels set to the scatter of their offsets; amplitude (k,): of all columns."""
    tolerance = columns.prior.tolerance.copy()
    for label, effect in EFFECT_OF.items():
        labels = [getattr(run, label) for run in bench.runs]
        if len(set(labels)) < 2 or None in labels:  # they differ from what the runs without one share
            continue
        first = {each: next(run for run in bench.runs if getattr(run, label) == each) for each in apart(labels)}
        for p in CandidateCause(effect, None, shelf.load("effects", effect)).parameters:
            mine = [columns.names.index(label_name(label, each, p.name)) for each in first]
            taken_up = np.array([run.run_path.clock_s if label == "clock" else 0.0 for run in first.values()])
            tolerance[mine] = max(scatter(amplitude[mine] + taken_up / p.scale), p.tolerance / p.scale)
    return replace(columns, prior=replace(columns.prior, tolerance=tolerance))
