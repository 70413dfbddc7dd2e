"""How large are the gap and the residual in every row and channel?

Gap: measured minus modelled by the machine file. Residual: measured minus modelled with the causes. Every kind of study
fills the same columns: `run`, where they are known `row` (of the log, from 1), `t_s` and `line`, and per channel
`gap_<channel>` and `rest_<channel>`, with the names and units of logs. Channels that were not logged are omitted.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from camcomp.diagnosis.arm.poses import ArmBench
from camcomp.diagnosis.arm.unseen import acting
from camcomp.diagnosis.axis.findings import lever_mm
from camcomp.diagnosis.experiment.open_experiment import columns_of
from camcomp.diagnosis.fit.bench import Run, thinned
from camcomp.diagnosis.result.types import DiagnosisResult
from camcomp.ground.datatypes import Floats
from camcomp.model.motion.log_columns import DYNO, LINE, TIME, TIP, log_columns
from camcomp.model.motion.twin import Twin

if TYPE_CHECKING:
    from camcomp.diagnosis.axis.findings import AxisChannel, AxisFindings
    from camcomp.diagnosis.diagnose import Diagnosis

Columns = dict[str, NDArray[Any]]


def of_runs(done: Diagnosis, twin: Twin, runs: Sequence[Run]) -> Columns:
    """Runs of programs in their order, those held out too: the causes are those fitted to the others."""
    names, causes = columns_of(twin), done.causes if done.result.known else []
    channels = (*TIP, *names.encoder, *names.drive, *DYNO)
    seen = {run.name: (bench, k) for bench in (done.problem.bench, done.judged) for k, run in enumerate(bench.runs)}
    parts = list[Columns]()
    for run in runs:
        bench, k = seen[run.name]
        gap = bench.gap(k)
        rest = bench.gap(k, causes) if causes else gap
        places = thinned(np.column_stack([run.run_path.time, run.measured.line]), run.thin)
        head = {"run": np.full(len(gap), run.name), TIME: places[:, 0], LINE: places[:, 1]}
        parts.append({**head, **_both(channels, gap, rest)})
    return _stacked(parts)


def of_poses(bench_of: Callable[[], ArmBench], result: DiagnosisResult) -> Columns:
    """Static poses without the outliers; tips in machine axes, in the frames that their result judges them in."""
    out = {(each.run, each.row) for each in result.outliers}
    bench = bench_of()
    found = acting(result.known)
    parts = list[Columns]()
    for k, poses in enumerate(bench.campaigns):
        kept = np.array([(str(r), int(n)) not in out for r, n in zip(poses.run, poses.rows, strict=True)])
        bench.campaigns[k] = poses.take(kept)
    for k, poses in enumerate(bench.campaigns):
        gap = bench.gap(k, ())
        rest = bench.gap(k, found) if found else gap
        parts.append({"run": poses.run, "row": poses.rows, **_both(TIP, gap, rest)})
    return _stacked(parts)


def of_axes(found: Sequence[AxisFindings], revolute: Mapping[str, bool]) -> Columns:
    """Logs of axes: encoder minus set-point, and drive force, each about its mean over the runs of the fit."""
    cells: dict[tuple[str, float], dict[str, float]] = {}
    for axis in found:
        names, lever = log_columns([axis.name], [revolute[axis.name]]), lever_mm(revolute[axis.name])
        both = ((axis.following, names.encoder[0], -1.0 / lever), (axis.force, names.drive[0], lever))
        for channel, name, factor in both:
            if channel is not None:
                _lay(cells, channel, name, factor)
    heads = list(dict.fromkeys(name for each in cells.values() for name in each))
    order = sorted(cells)
    out: Columns = {"run": np.array([run for run, _ in order]), TIME: np.array([time for _, time in order])}
    return out | {name: np.array([cells[key].get(name, np.nan) for key in order]) for name in heads}


def _lay(cells: dict[tuple[str, float], dict[str, float]], channel: AxisChannel, name: str, factor: float) -> None:
    """Add gap and residual of every row of one channel's fitted and held-out runs to the cells."""
    middle = float(np.mean(channel.rows))
    for r in channel.runs:
        times, gap = (r.whole[0], r.whole[1] - middle) if r.fitted else (r.move.time, r.gap)
        for column, at, each in ((f"gap_{name}", times, gap), (f"rest_{name}", r.move.time, r.left)):
            for time, value in zip(at.tolist(), each.tolist(), strict=True):
                cells.setdefault((r.name, time), {})[column] = factor * value


def _both(names: Sequence[str], gap: Floats, rest: Floats) -> Columns:
    return {
        f"{kind}_{name}": values[:, j]
        for kind, values in (("gap", gap), ("rest", rest))
        for j, name in enumerate(names)
    }


def _stacked(parts: Sequence[Columns]) -> Columns:
    """Runs below each other; numeric channels without a finite value are dropped."""
    whole = {name: np.concatenate([each[name] for each in parts]) for name in parts[0]}
    return {name: values for name, values in whole.items() if values.dtype.kind != "f" or np.isfinite(values).any()}
