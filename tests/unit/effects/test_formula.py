"""The effects formula and map in a machine file: what they move, where they end, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from camcomp.ground import notes
from camcomp.ground.errors import ConfigError
from camcomp.model.config.load import load_config
from camcomp.model.effect import Load, Motion
from camcomp.model.job import Job
from camcomp.model.motion.response import aim_at, respond
from camcomp.model.motion.travel import Travel
from camcomp.model.signal_path import controlled, driven, placed

CONFIG = Path(__file__).parents[3] / "config"
ACTUATORS = ("x", "y", "z")


def job_with(tmp_path, *effects, machine="cartesian"):
    over = tmp_path / "over.yaml"
    over.write_text("effects:\n" + "".join(f"  - {{{each}}}\n" for each in effects))
    return Job(load_config([str(CONFIG / f"{machine}.yaml"), str(over)]))


def motion(position):
    t = np.arange(len(position)) * 0.1
    zero = np.zeros_like(position)
    return Motion(
        time=t,
        common=t,
        cut_min=t,
        temperature=None,
        encoder=position,
        speed=zero,
        direction=zero,
        home=np.zeros(3),
        stiffness=np.full(3, np.inf),
    )


def shifts(job, position):
    """Encoder, carriage and tip shifts (n, 3) of a movement (n, 3)."""
    m = motion(np.asarray(position, float))
    load = Load(np.zeros_like(m.encoder), np.zeros((len(m.time), 6)))
    servo = controlled(job.causes, ACTUATORS, m) - m.encoder
    return servo, driven(job.causes, ACTUATORS, m)[0], placed(job.causes, m.encoder, load, m) - m.encoder


ROWS = np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 0.0], [2.0, 4.0, 0.0]])


@pytest.mark.parametrize(
    ("entry", "where", "expected"),
    [
        ("effect: formula, stage: control, target: y, formula: 0.1*act_mm", 0, [[0, 0, 0], [0, 0.2, 0], [0, 0.4, 0]]),
        ("effect: formula, stage: drive, target: y, formula: act_mm^2", 1, [[0, 0, 0], [0, 4, 0], [0, 16, 0]]),
        ("effect: formula, stage: structure, axis: z, formula: x_mm*y_mm", 2, [[0, 0, 0], [0, 0, 2], [0, 0, 8]]),
        ("effect: formula, stage: tool, axis: x, formula: vy_mm_per_s", 2, [[20, 0, 0], [20, 0, 0], [20, 0, 0]]),
    ],
)
def test_a_formula_moves_what_it_is_on_and_nothing_else(tmp_path, entry, where, expected):
    found = shifts(job_with(tmp_path, entry), ROWS)
    for k, each in enumerate(found):
        assert each == pytest.approx(np.array(expected, float) if k == where else 0.0), k


def test_a_map_is_smooth_and_never_exceeds_its_coefficients(tmp_path):
    entry = "effect: map, stage: structure, axis: x, over: [y_mm], envelope: {y_mm: [0, 10]}, coefficients_mm: [0, 0, 1, 0, 0]"
    y = np.linspace(-2.0, 12.0, 281)
    tip = shifts(job_with(tmp_path, entry), np.column_stack([0 * y, y, 0 * y]))[2][:, 0]
    assert 0.6 < tip.max() <= 1.0 and tip.min() >= 0.0
    assert np.abs(np.diff(tip[(y >= 0) & (y <= 10)], 2)).max() < 3e-4
    assert np.abs(np.diff(tip)).max() < 0.02
    assert y[tip.argmax()] == pytest.approx(5.0)


def test_outside_its_envelope_a_law_fades_to_nothing_and_says_so_once(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(notes, "_told", set())
    job = job_with(tmp_path, "effect: formula, stage: structure, axis: x, formula: '1', envelope: {y_mm: [0, 10]}")
    y = np.linspace(-3.0, 13.0, 161)
    for _ in range(2):
        tip = shifts(job, np.column_stack([0 * y, y, 0 * y]))[2][:, 0]
    assert tip[(y >= 0) & (y <= 10)] == pytest.approx(1.0)
    assert tip[(y < -1) | (y > 11)] == pytest.approx(0.0)
    assert np.abs(np.diff(tip)).max() < 0.2
    said = capsys.readouterr().err
    assert said.count("note:") == 1 and "y_mm from 0 to 10" in said


def test_the_response_has_it_and_the_correction_takes_it_out(tmp_path):
    job = job_with(tmp_path, "effect: formula, stage: structure, axis: x, formula: 2e-3*y_mm + 0.01*sin(x_mm/5)")
    target = np.array([[0.0, 0.0, 0.0], [5.0, 10.0, 0.0], [9.0, 25.0, 0.0]])
    n = len(target)
    travel = Travel(force=np.zeros((n, 3)), time=np.arange(n) * 1.0, cut_min=np.zeros(n), stop=np.ones(n, bool))
    plain, _ = respond(job, target, travel)
    assert (plain - target)[:, 0] == pytest.approx(2e-3 * target[:, 1] + 0.01 * np.sin(target[:, 0] / 5), abs=1e-9)
    told = aim_at(job, target, travel, "newton").commanded
    assert respond(job, told, travel)[0] == pytest.approx(target, abs=2e-5)


def test_the_place_is_where_the_set_points_lead_the_tip_and_not_where_the_load_bends_it(tmp_path):
    plain = Job(load_config([str(CONFIG / "orthoglide.yaml")]))
    job = job_with(tmp_path, "effect: formula, stage: structure, axis: x, formula: 0.1*y_mm", machine="orthoglide")
    told, at = np.array([[5.0, 10.0, 0.0]]), {"time": np.zeros(1), "cut_min": np.zeros(1), "stop": np.ones(1, bool)}
    travel = Travel(force=np.array([[150.0, 180.0, 60.0]]), **at)
    loaded, found = respond(plain, told, travel)[0], respond(job, told, travel)[0]
    assert abs(loaded - told)[0, 1] > 0.05
    assert found - loaded == pytest.approx(np.array([[1.0, 0.0, 0.0]]), abs=1e-9)


def test_where_the_tip_stands_or_plunges_it_does_not_move_in_the_plane(tmp_path):
    job = job_with(tmp_path, "effect: formula, stage: structure, axis: x, formula: moving")
    way = np.array([[0, 0, 5], [0, 0, 3], [0, 0, 0], [0, 0, 0], [2, 0, 0], [4, 0, 0], [6, 1, 0]], float)
    assert shifts(job, way)[2][:, 0].tolist() == [0, 0, 0, 1, 1, 1, 1]


# springs of the machine files: a law that goes evenly with a drive's own load is a softer spring
@pytest.mark.parametrize(
    ("machine", "target", "load", "spring", "at"),
    [
        ("orthoglide", "y", "load_N", 1.0e4, [10.0, 20.0, 0.0]),
        ("kuka-kr210", "A2", "load_Nmm", 3.377e9, [30.0, 0.0, 5.0]),
    ],
)
def test_a_drive_that_gives_way_evenly_with_its_load_is_a_softer_one(tmp_path, machine, target, load, spring, at):
    plain = Job(load_config([str(CONFIG / f"{machine}.yaml")]))
    law = job_with(
        tmp_path, f"effect: formula, stage: drive, target: {target}, formula: -{load}/{4 * spring}", machine=machine
    )
    soft = job_with(tmp_path, f"effect: drive_stiffness, target: {target}, factor: 0.8", machine=machine)
    travel = Travel(
        force=np.array([[150.0, -180.0, 60.0]]), time=np.zeros(1), cut_min=np.zeros(1), stop=np.ones(1, bool)
    )
    tips = [respond(job, np.array([at]), travel)[0][0] for job in (plain, law, soft)]
    assert np.linalg.norm(tips[2] - tips[0]) > 1e-3
    assert tips[1] - tips[0] == pytest.approx(tips[2] - tips[0], abs=0.02 * np.linalg.norm(tips[2] - tips[0]))


@pytest.mark.parametrize(
    ("entry", "rule", "column", "words"),
    [
        ("effect: formula, stage: structure, axis: x, formula: 2*zz_mm", "CC290", 61, "'zz_mm' is not known"),
        ("effect: formula, stage: drive, target: x, formula: '1 + x_mm'", "CC290", 62, "'x_mm' is not known"),
        ("effect: formula, stage: structure, formula: '1'", "CC205", 5, "needs axis"),
        ("effect: formula, stage: drive, axis: x, formula: '1'", "CC205", 5, "has no axis"),
        ("effect: formula, stage: gut, axis: x, formula: '1'", "CC205", 30, "'gut' is not known"),
        ("effect: formula, stage: drive, formula: '1', envelope: {x_mm: [0, 1]}", "CC290", 5, "x_mm"),
        ("effect: formula, stage: drive, formula: '1', envelope: {act_mm: [1, 0]}", "CC209", 70, "limits"),
        ("effect: map, stage: drive, over: [act_mm], coefficients_mm: [1, 2, 3, 4]", "CC291", 5, "act_mm"),
        ("effect: map, stage: drive, over: [act_mm], envelope: {act_mm: [0, 1]}, coefficients_mm: [1, 2]", "CC291", 5, "4"),
        ("effect: formula, stage: structure, axis: x, formula: '1', target: x", "CC205", 72, "no target"),
        ("effect: formula, stage: drive, target: x, formula: load_q_N", "CC205", 14, "no drive 'q'"),
        ("effect: formula, stage: control, target: x, formula: load_N", "CC290", 59, "'load_N' is not known"),
    ],
)  # fmt: skip
def test_mistakes_are_told_with_their_place(tmp_path, entry, rule, column, words):
    with pytest.raises(ConfigError) as error:
        job_with(tmp_path, entry)
    assert (error.value.rule, error.value.at.line, error.value.at.column) == (rule, 2, column)
    assert words in f"{error.value.message} {error.value.hint}"
