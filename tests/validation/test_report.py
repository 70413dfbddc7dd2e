"""The pages state the stored results; results add up, go on where they stopped, and take seeds that are free."""

import json
from pathlib import Path

import pytest

from tests.validation import counting, report, store


def test_committed_pages_and_the_lines_of_the_readme_are_those_of_the_stored_results():
    told = "python -m tests.validation report"
    for path, text in report.pages().items():
        assert path.read_text(encoding="utf-8") == text, f"{path.name}: {told}"
    readme = (report.ROOT / "README.md").read_text(encoding="utf-8")
    assert report.with_lines(readme) == readme, told
    assert all(len(line) <= 150 for line in report.readme_lines())


def test_pages_of_generators_without_results_do_not_exist():
    generated = {path.name for path in report.pages()}
    assert {path.name for path in report.PAGES.glob("*")} == generated


@pytest.mark.parametrize("path", sorted(store.RESULTS.glob("*/*.json")), ids=lambda path: path.parent.name)
def test_seeds_of_one_generator_are_used_once(path):
    result = json.loads(path.read_text())
    if result["first_seed"] is not None:
        assert result["next_seed"] - result["first_seed"] == result["experiments"]
        for other in store.all_of(result["generator"]):
            apart = other["first_seed"] >= result["next_seed"] or other["next_seed"] <= result["first_seed"]
            assert apart or other["tree"] == result["tree"]


@pytest.fixture
def results(tmp_path, monkeypatch):
    monkeypatch.setattr(store, "RESULTS", tmp_path)
    return tmp_path


def test_a_run_goes_on_where_it_stopped_and_new_code_takes_new_seeds(results, monkeypatch):
    monkeypatch.setattr(store, "code", lambda: store.Code("c1", "2026-01-01", "t1"))
    first = store.opened("axes", 100)
    counting.add(
        first, 100, [("whole answer right", True)], [{"seconds": 2.0, "calibration": [[0.95, True], [0.2, False]]}]
    )
    store.save(first)
    again = store.opened("axes", 100)
    assert again == first and again["next_seed"] == 101 and again["experiments"] == 1
    monkeypatch.setattr(store, "code", lambda: store.Code("c2", "2026-01-02", "t2"))
    assert store.opened("axes", 100)["first_seed"] == 101
    assert Path(results / "axes" / "2026-01-01-t1.json").exists()


def test_rates_add_up_with_wilson_intervals():
    result = {"generator": "axes", "first_seed": 0, "commit": "c", "date": "d"}
    for seed in range(10):
        wrong = {"wrong": "single | <x>"} if seed == 3 else {}
        counting.add(result, seed, [("whole answer right", seed != 3)], [{"calibration": [[0.9, seed != 3]], **wrong}])
    text = report.page("axes", [result])
    assert "| whole answer right | 9 of 10 | 0.900 | 0.596 to 0.982 |" in text
    assert "| 3 | single / &lt;x> |" in text
    assert counting.calibration_error(result["calibration"]) == (pytest.approx(0.0, abs=1e-9), 10)
    assert report.plot([result]).count("<circle") == 2


def test_the_calibration_error_is_the_distance_in_bins():
    result = {}
    counting.add(result, 0, [], [{"calibration": [[0.95, True], [0.95, False], [0.15, False], [0.15, True]]}])
    assert counting.calibration_error(result["calibration"]) == (pytest.approx((0.9 + 0.7) / 4), 4)
