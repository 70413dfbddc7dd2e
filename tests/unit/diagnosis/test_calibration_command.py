"""One command fits the calibration maps of every kind of log."""

import json

import pytest

from tests.validation import calibration


@pytest.mark.parametrize(("kind", "maps"), [("programs", {"programs"}), ("poses", {"poses", "poses beside unknown"})])
def test_maps_of_a_kind_come_from_its_rows_and_name_their_seeds(tmp_path, kind, maps):
    rows = [
        {"name": f"e-{90_000 + k}", "unknown": unknown, "calibration": [[0.9, k % 4 > 0]], "misses": [2.0]}
        for k in range(40)
        for unknown in [k % 2 == 0]
    ]
    file = tmp_path / "rows.jsonl"
    file.write_text("".join(json.dumps(row) + "\n" for row in rows))
    found = calibration.calibrate(kind, file)
    assert set(found) == maps
    assert all(each["interval"] == pytest.approx(2.0) for each in found.values())
    assert sorted(seed for each in found.values() for seed in each["seeds"]) == list(range(90_000, 90_040))
