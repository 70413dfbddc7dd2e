"""The history of a machine: what is kept, and whether what is called drift or jump is one."""

import json

import numpy as np
import pytest

from camcomp.diagnosis.history.drift import course_of, days_until
from camcomp.terminal.cli import run
from tests.report.diagnoses import cause, result

DAYS = np.arange(0.0, 360.0, 30.0)


def drawn(mean, seed, sd=1.0):
    return mean + np.random.default_rng(seed).normal(0.0, sd, len(DAYS))


def test_values_that_stay_are_called_steady_in_nineteen_of_twenty():
    kinds = [course_of(DAYS, drawn(5.0, seed), np.ones(len(DAYS))).kind for seed in range(400)]
    assert kinds.count("steady") >= 380


def test_a_drift_is_told_from_jumps_and_its_interval_holds():
    """13 deviations in a year; where it is called a drift (nine of ten at least), 95 % of the intervals hold its rate."""
    found = [course_of(DAYS, drawn(0.04 * DAYS, seed), np.ones(len(DAYS))) for seed in range(200)]
    drifts = [each for each in found if each.kind == "drift"]
    assert len(drifts) >= 180
    held = sum(abs(each.rate - 0.04) < 1.96 * each.rate_sd for each in drifts)
    assert 0.90 <= held / len(drifts) <= 0.995


@pytest.mark.parametrize("at", [3, 6, 10])
def test_a_jump_is_found_where_it_is(at):
    right = 0
    for seed in range(50):
        course = course_of(DAYS, drawn(np.where(np.arange(len(DAYS)) < at, 0.0, 8.0), seed), np.ones(len(DAYS)))
        right += course.kind == "jumps" and course.jumps == (at,)
    assert right >= 45, "nine of ten"


def test_there_and_back_are_two_jumps():
    row = np.arange(len(DAYS))
    course = course_of(DAYS, drawn(np.where((row >= 4) & (row < 8), 9.0, 0.0), 1), np.ones(len(DAYS)))
    assert course.kind == "jumps" and course.jumps == (4, 8)
    assert course.level == pytest.approx(0.0, abs=1.5), "what holds now is the last piece"


def test_three_values_say_nothing_of_a_course():
    assert course_of(DAYS[:3], np.array([0.0, 9.0, 0.0]), np.ones(3)).kind == "too few"


def test_the_best_division_is_that_of_trying_all():
    from itertools import combinations

    from camcomp.diagnosis.history.drift import _steps

    rng = np.random.default_rng(3)
    values, weight = rng.normal(0, 1, 9), rng.uniform(0.5, 2.0, 9)

    def left(starts):
        ends = [*starts[1:], 9]
        parts = [(values[a:b], weight[a:b]) for a, b in zip(starts, ends, strict=True)]
        return sum(float(np.sum(w * (v - np.average(v, weights=w)) ** 2)) for v, w in parts)

    for count, (starts, found) in enumerate(_steps(values, weight)):
        best = min(left((0, *each)) for each in combinations(range(1, 9), count))
        assert found == pytest.approx(best) and left(starts) == pytest.approx(best)


def test_the_sooner_the_faster_it_drifts():
    slow, fast = (course_of(DAYS, rate * DAYS, np.full(len(DAYS), 0.1)) for rate in (0.01, 0.05))
    assert days_until(fast, 2.0) < days_until(slow, 2.0)
    assert days_until(fast, 2.0) == pytest.approx(2.0 / 0.05, rel=0.15)


def written(tmp_path, name, width):
    found = result("identified").model_copy(update={"causes": ()}).as_json()
    found["causes"] = [cause("backlash", "x", 0.97, 0.9, width_mm=width)]
    path = tmp_path / name
    path.write_text(json.dumps(found))
    return path


def test_diagnoses_are_kept_and_told(tmp_path, capsys):
    folder = tmp_path / "machine"
    for month, width in enumerate((0.010, 0.014, 0.018, 0.022, 0.026), 1):
        path = written(tmp_path, f"{month}.json", width)
        assert run(["history", str(folder), "--add", str(path), "--day", f"2026-0{month}-15"]) == 0
    told = capsys.readouterr().out
    assert "backlash (x) width_mm: 0.0260 (0.0234 to 0.0286) on 2026-05-15; drifts by" in told
    assert run(["history", str(folder), "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)
    (course,) = found["parameters"]
    assert course["course"] == "drift" and course["rate_per_year"] == pytest.approx(0.004 * 12, rel=0.15)
    assert [each["day"] for each in found["verdicts"]] == [f"2026-0{k}-15" for k in range(1, 6)]
    assert found["measure_again"] == course["measure_again"] > "2026-05-15"
    sooner = tmp_path / "t.json"
    assert run(["history", str(folder), "--tolerance-um", "2", "--json", str(sooner)]) == 0
    assert json.loads(sooner.read_text())["measure_again"] < found["measure_again"]


def test_the_same_diagnosis_twice_is_refused(tmp_path, capsys):
    path = str(written(tmp_path, "a.json", 0.02))
    assert run(["history", str(tmp_path / "m"), "--add", path]) == 0
    assert run(["history", str(tmp_path / "m"), "--add", path, "--day", "2026-01-01"]) == 2
    assert "CC455" in capsys.readouterr().err and len(list((tmp_path / "m").iterdir())) == 1


@pytest.mark.parametrize("text", ["", "[]", '{"day": "x"}', '{"day": "2026-01-01", "result": {}}', "\xff"])
def test_a_strange_file_is_named(tmp_path, capsys, text):
    (tmp_path / "odd.json").write_bytes(text.encode("latin-1"))
    assert run(["history", str(tmp_path)]) == 2
    assert "CC454" in (err := capsys.readouterr().err) and "odd.json" in err
    assert run(["history", str(tmp_path / "m"), "--add", str(tmp_path / "odd.json")]) == 2
    assert not list((tmp_path / "m").glob("*"))


def test_no_folder_and_an_empty_one(tmp_path, capsys):
    assert run(["history", str(tmp_path / "none")]) == 5
    (tmp_path / "empty").mkdir()
    assert run(["history", str(tmp_path / "empty")]) == 0
    assert "nothing is kept here yet" in capsys.readouterr().out
