"""Runs with measured tips only: its time along the path is free, and what cannot be seen is not named."""

from dataclasses import replace

import numpy as np
import pytest

from camcomp.diagnosis.experiment.open_experiment import open_experiment
from camcomp.diagnosis.fit.bench import Bench
from camcomp.diagnosis.fit.columns import candidate_causes, candidate_columns
from camcomp.ground.errors import ConfigError
from tests.validation.recorded.experiment import Bench as Machine
from tests.validation.recorded.experiment import Made, Plan, character, row_times, schedule, write

PLAN = Plan(5, machine="orthoglide", channels="tip", rows=250, runs=3, stated=True, paths=("circles-blended", "pocket-10um", "ramp-100um"))  # fmt: skip


def opened(folder, change=lambda rows: rows, away=(0.0, 0.0, 0.0)):
    """The experiment of a machine without errors, opened; its logs changed; away: mm, where it stood before the programs."""
    rng = np.random.default_rng(PLAN.seed)
    ways = character(rng, False)
    runs = [_begun(run, np.array(away)) for run in schedule(PLAN, rng)]
    machine = Machine(PLAN, runs, ways)
    times = [row_times(run, PLAN, True, rng) for run in runs]
    made = Made(runs, machine.see((), times), {"runs": [{} for _ in runs]})
    path = write(made, PLAN, folder)
    for log in folder.glob("log-*.csv"):
        rows = [line.split(",") for line in log.read_text().splitlines()]
        log.write_text("\n".join(",".join(row) for row in change(rows)) + "\n")
    return open_experiment(path)


def _begun(run, away):
    """A run whose way to the first place comes from elsewhere."""
    record = run.recording
    first = int(np.argmax(record.kind > 1))
    tip = record.tip.copy()
    tip[:first] += np.linspace(1.0, 0.0, first)[:, None] * away
    return replace(run, recording=replace(record, tip=tip))


def without_line(rows):
    at = rows[0].index("line")
    return [row[:at] + row[at + 1 :] for row in rows]


def with_breaks(rows):
    """Every 40th row off by some millimetres."""
    x = rows[0].index("x_mm")
    for row in rows[20::40]:
        row[x] = f"{float(row[x] or 0.0) + 6.0:.4f}"
    return rows


@pytest.mark.parametrize("change", [lambda rows: rows, without_line, lambda rows: with_breaks(without_line(rows))])
def test_a_machine_that_bends_by_more_than_half_a_millimetre_leaves_the_noise(tmp_path, change):
    found = opened(tmp_path, change, away=(30.0, -20.0, 14.0))
    bench = Bench(twin=found.twin, runs=found.runs)
    gaps = np.concatenate([bench.gap(k)[:, :3] for k in range(len(bench.runs))])
    size = 1e3 * np.linalg.norm(gaps[np.isfinite(gaps).all(axis=1)], axis=1)
    assert len(size) > 0.6 * len(gaps)
    # two of three axes are evidence
    assert np.sqrt(np.mean(np.sort(size)[: int(0.99 * len(size))] ** 2)) < 1.1 * 3.0 * np.sqrt(3.0)


def test_no_clock_is_seen_and_no_lag_that_all_drives_share(tmp_path):
    found = opened(tmp_path)
    bench = Bench(twin=found.twin, runs=found.runs)
    causes = {(each.name, each.target): each for each in candidate_causes(found.twin.robot)}

    def moves(name, target):
        column = candidate_columns(bench, causes[name, target], {})[0]
        seen = [np.where(np.isfinite(bench.observed(k)[:, :3]), c[:, :3], 0.0) for k, c in enumerate(column)]
        return 1e3 * np.sqrt(np.mean(np.concatenate(seen) ** 2) * 3.0)

    assert moves("time_sync", None) == 0.0
    assert moves("servo_lag", None) < 0.03 * moves("servo_lag", "x")


@pytest.mark.parametrize(("scale", "rule", "said"), [(1e-3, "CC407", "logged in m"), (1 / 25.4, "CC407", "inches")])
def test_another_unit_is_told(tmp_path, scale, rule, said):
    def scaled(rows):
        at = [rows[0].index(f"{a}_mm") for a in "xyz"]
        return [rows[0], *([f"{float(c) * scale:.7f}" if j in at and c else c for j, c in enumerate(row)] for row in rows[1:])]  # fmt: skip

    with pytest.raises(ConfigError) as caught:
        opened(tmp_path, scaled)
    assert caught.value.rule == rule and said in caught.value.message
