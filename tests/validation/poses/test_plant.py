"""The plant of arms against known results, and its experiments."""

from __future__ import annotations

import csv
import json
from functools import cache

import numpy as np
import pytest
import yaml

from tests.validation.poses.arm import GRAVITY, ROOT, Off, load_arm
from tests.validation.poses.causes import ODDS, Local, alike, library, remains, rms, strange
from tests.validation.poses.make import MACHINES, draw_plant, make
from tests.validation.poses.plant import Plant, Run, play, poses


def plant(name: str, count: int = 80, seats: int = 2, seed: int = 1) -> Plant:
    rng = np.random.default_rng(seed)
    arm = load_arm(name)
    runs = []
    for k in range(seats):
        q = poses(arm, "joints", count, rng)
        runs.append(Run(f"run-{k}", k, 5000.0 * k, "joints", 1, q, 10.0 * np.arange(count)))
    place = [(np.eye(3), np.array([3000.0, 500.0 * k, 900.0])) for k in range(seats)]
    return Plant(arm, runs, rng.uniform(-60, 60, (seats, 3)) - [0, 0, arm.tool_mm], place, (8.0, 2000.0, 0.0, 86400.0))


@cache
def table(name: str) -> dict:
    return yaml.safe_load((ROOT / "config" / f"{name}.yaml").read_text())["robot"]


def matrices(name: str, q: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray], np.ndarray]:
    """Frames in front of the joints, centres of mass and the platform of one pose, by products of 4x4 matrices."""
    robot, frame = table(name), np.eye(4)
    frame[:3, 3] = robot.get("base", {}).get("translation_mm", [0, 0, 0])
    before, centres = [], []
    for angle, row in zip(q, robot["joints"], strict=True):
        before.append(frame)
        turn, slope = angle + np.radians(row.get("theta_deg", 0)), np.radians(row.get("alpha_deg", 0))
        c, s, ca, sa = np.cos(turn), np.sin(turn), np.cos(slope), np.sin(slope)
        a, d = row.get("a_mm", 0), row.get("d_mm", 0)
        frame = frame @ [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
        centres.append((frame @ [*row["centre_mm"], 1])[:3])
    return before, centres, frame @ np.diag([1.0, -1, -1, 1])


@pytest.mark.parametrize("name", MACHINES)
def test_frames_are_those_of_the_table_and_loads_the_slope_of_the_energy(name):
    arm = load_arm(name)
    arm.stiffness = arm.stiffness * np.inf
    q = poses(arm, "joints", 3, np.random.default_rng(2))
    stand = arm.stand(q, push=100.0)

    def energy(at: np.ndarray) -> float:
        _, centres, end = matrices(name, at)
        return float(sum(m * GRAVITY * c[2] for m, c in zip(arm.mass, centres, strict=True)) + 100.0 * end[2, 3])

    for k in range(len(q)):
        before, _, end = matrices(name, q[k])
        assert np.abs(stand.point[k] - end[:3, 3]).max() < 1e-2 and np.abs(stand.turn[k] - end[:3, :3]).max() < 1e-9
        for j in range(6):
            assert np.abs(stand.joint_point[j, k] - before[j][:3, 3]).max() < 1e-2
            step = 1e-5 * np.eye(6)[j]
            slope = (energy(q[k] + step) - energy(q[k] - step)) / 2e-5
            assert stand.load[k, j] == pytest.approx(-slope, rel=1e-4, abs=5)


def test_springs_stand_in_equilibrium():
    arm = load_arm("kuka-kr210")
    q = poses(arm, "joints", 6, np.random.default_rng(3))
    off = Off.nothing()
    off.stiffness[1] = 0.5
    stand = arm.stand(q, off)
    rigid = load_arm("kuka-kr210")
    rigid.stiffness = rigid.stiffness * np.inf
    held = rigid.stand(q + stand.load / (arm.stiffness * off.stiffness))
    assert np.abs(held.load - stand.load).max() < 1e-3 * np.abs(stand.load).max() * 1e-2
    assert np.abs(held.point - stand.point).max() < 1e-2
    assert (stand.point[:, 2] < rigid.stand(q).point[:, 2]).all()


@pytest.mark.parametrize("series", ["A", "B"])
def test_a_real_arm_stands_a_millimetre_from_its_table(series):
    arm = load_arm("ur10")
    with (ROOT / "samples" / "ur10" / f"series_{series}.csv").open() as file:
        rows = list(csv.DictReader(file))
    q = np.array([[float(row[f"act_{n}_rad"]) for n in arm.names] for row in rows])
    seen = np.array([[float(row[f"{a}_mm"]) for a in "xyz"] for row in rows])
    assert 0.4 < rms(best_frame(arm.stand(q), seen)) / 1e3 < 1.5


def best_frame(stand, seen: np.ndarray, seat: np.ndarray | None = None) -> np.ndarray:
    """Residual (n, 3) of measured points after a fit of the tracker's frame and the target's position."""
    seat = np.zeros(3) if seat is None else seat
    for _ in range(10):
        tip = stand.point + stand.turn @ seat
        u, _, v = np.linalg.svd((tip - tip.mean(0)).T @ (seen - seen.mean(0)))
        turn = (u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v).T
        left = seen - seen.mean(0) - (tip - tip.mean(0)) @ turn.T
        lever = (turn @ stand.turn) - (turn @ stand.turn).mean(0)
        seat = seat + np.linalg.lstsq(lever.reshape(-1, 3), left.ravel(), rcond=None)[0]
    return left


def test_signs_of_the_contract():
    p = plant("ur10", seats=1)
    nothing = Off.nothing()
    off = nothing.copy()
    off.offset[2], off.pitch[0], off.coupling[4] = 1e-3, 1e-4, 1e-3
    shift = p.carriages(off) - p.q
    assert shift[:, 2] == pytest.approx(1e-3) and shift[:, 0] == pytest.approx(1e-4 * p.q[:, 0])
    assert shift[:, 4] == pytest.approx(1e-3 * p.q[:, 3])
    off = nothing.copy()
    off.length[1] = 2.0
    links = [p.arm.stand(p.q, o) for o in (nothing, off)]
    sizes = [np.linalg.norm(s.joint_point[2] - s.joint_point[1], axis=1) for s in links]
    assert sizes[1] - sizes[0] == pytest.approx(2.0)
    off = nothing.copy()
    off.tool = 1.0
    assert p.tips(off) - p.tips(nothing) == pytest.approx(-p.stand().turn[:, :, 2])
    shift = play(np.array([[0.0], [1], [2], [1], [0], [0.05]]), 0.2)[:, 0]
    assert shift == pytest.approx([0, -0.1, -0.1, 0.1, 0.1, 0.05])
    off = nothing.copy()
    off.growth += 1e-5
    assert p.carriages(off) - p.q == pytest.approx(np.tile(1e-5 * (p.temp - 20)[:, None], 6))


@pytest.mark.parametrize("name", MACHINES)
def test_the_span_holds_the_library_and_not_what_is_strange(name):
    p = plant(name, 36)
    rng = np.random.default_rng(4)
    local = Local(p)
    span = local.span()
    for item in library(p, rng):
        change = local.free(local.of(item, 0.3 * item.unit))
        if rms(change) > 0.5:
            assert rms(remains(span, change)) < 0.08 * rms(change) + 0.05, item.key
    for odd in ("cable", "rocking_seat", "angle_bump", "cold_oil"):
        fault = strange(p, local, odd, rng)
        change = local.free(p.tips(local.off, fault) - local.base)
        assert rms(remains(span, change)) > 0.1 * rms(change), odd
    assert len(ODDS) >= 8


def test_what_looks_alike():
    p = plant("kuka-kr210")
    local = Local(p)
    items = {item.key: item for item in library(p, np.random.default_rng(5))}

    def sets(*keys) -> list[set]:
        change = sum(local.of(items[key], 3 * items[key].unit) for key in keys)
        return [set(one) for one in alike(local, list(keys), change, 0.02)]

    assert {("backlash", "A3")} in sets(("joint_hysteresis", "A3"))
    assert {("drive_stiffness", "A2")} in sets(("gravity_compliance", "A2"))
    assert {("link_geometry", "A2")} in sets(("link_length", "A2"))
    assert {("joint_offset", "A3")} not in sets(("link_length", "A2"))


def test_frames_take_up_what_they_can():
    plant_, said = draw_plant(load_arm("ur10"), "single", np.random.default_rng(11))
    local = Local(plant_)
    items = {item.key: item for item in library(plant_, np.random.default_rng(5))}
    change = local.of(items["joint_offset", "shoulder_pan"], 1e-5)
    assert rms(local.free(change)) < 1e-3 * rms(change) and "framed" in said


def test_an_experiment_says_nothing_of_its_answer_and_comes_again(tmp_path):
    make(2, tmp_path, "ur10")
    truth = json.loads((tmp_path / "truth" / "e-2.json").read_text())
    assert truth["kind"] == "unknown" and min(c.get("left_ratio", 9) for c in truth["causes"]) >= 1.2
    text = (tmp_path / "e-2" / "experiment.yaml").read_text()
    assert not any(word in text for word in ("kind", "seed", "truth", truth["causes"][-1]["effect"]))
    for folder in ("once", "again"):
        make(8, tmp_path / folder, "ur10")
    for path in (tmp_path / "again" / "e-8").iterdir():
        assert path.read_bytes() == (tmp_path / "once" / "e-8" / path.name).read_bytes()


def test_a_healthy_arm_scatters_by_the_noise_that_the_answer_states(tmp_path):
    make(20, tmp_path, "kuka-kr210")
    truth = json.loads((tmp_path / "truth" / "e-20.json").read_text())
    arm = load_arm("kuka-kr210")
    left = []
    for k in range(len(truth["sensors"]["rows"])):
        with (tmp_path / "e-20" / f"log-{k + 1}.csv").open() as file:
            rows = [row for row in csv.DictReader(file) if all(row.values())]
        q = np.array([[float(row[f"act_{n}_rad"]) for n in arm.names] for row in rows])
        left.append(best_frame(arm.stand(q), np.array([[float(row[f"{a}_mm"]) for a in "xyz"] for row in rows])))
    assert rms(np.concatenate(left)) == pytest.approx(truth["noise_um"], rel=0.25)
