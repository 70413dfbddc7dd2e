"""A law that no library has is found, written into the machine file, and compensated with it the machine cuts true.

Beside it the mirror technique, which needs a test cut for every part and feed.
"""

import json
import re
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from tests.validation import runner
from tests.validation.recorded import recut
from tests.validation.recorded.hidden_laws import NOISE_MM, Experiment
from tests.validation.recorded.plant import Run
from tests.validation.recorded.sensors import Sensors, table, write_log
from tests.validation.recordings.recording import STEP_S

CONFIG = Path(__file__).parents[2] / "config"
ENOUGH_UM = 10.0


def polygon(radii, feed, turn=0.0):
    """A closed path in the plane, in chords."""
    lines = ["G21 G90 G17", "G0 Z5", f"G0 X{radii[0] * np.cos(turn):.3f} Y{radii[0] * np.sin(turn):.3f}", "G1 Z0 F600"]
    corners = [
        r * np.array([np.cos(a + turn), np.sin(a + turn)])
        for r, a in zip([*radii, radii[0]], np.linspace(0, 2 * np.pi, len(radii) + 1), strict=True)
    ]
    for a, b in pairwise(corners):
        lines += [f"G1 X{x:.3f} Y{y:.3f} F{feed}" for x, y in a + (b - a) * (np.arange(1, 5) / 4)[:, None]]
    return "\n".join([*lines, "G0 Z5", "M30", ""])


PART = polygon([20, 12, 21, 14, 20, 13], 900)
OTHER_PART = polygon([17, 17, 17, 17, 17], 900, 0.4)
OTHER_FEED = PART.replace("F900", "F2400")


@pytest.fixture(scope="module")
def lathe(tmp_path_factory):
    """A router with a wave along its rack, the diagnosis of its runs, and a way to let it cut."""
    folder = tmp_path_factory.mktemp("law")
    made = Experiment("rack_period", "x", "router", 6, 12.0, 220)
    made.write(folder / "runs")
    out, better = folder / "out.json", folder / "better.yaml"
    code, said = runner.invoke(
        ["diagnose", str(folder / "runs" / "experiment.yaml"), "--json", str(out), "--write-config", str(better)]
        + ["--report", str(folder / "report.html"), "--library", str(folder / "library")]
    )
    assert code == 0, said
    return SimpleNamespace(
        made=made, folder=folder, said=said, better=better, result=json.loads(out.read_text()), cuts=0, report=folder / "report.html",
        library=folder / "library",
    )  # fmt: skip


def cut(lathe, program, original, log=None):
    """The machine drives a program in the air; how far it misses the original one, um, and its log."""
    run = Run(recut.driven(program), False, 900.0)
    made = lathe.made
    times = np.arange(0.0, run.last_s, 0.04) + STEP_S
    runs, made.runs = made.runs, [run]
    state = made.see(made.size, [np.minimum(times, run.last_s)])[0]
    made.runs = runs
    lathe.cuts += 1
    if log is not None:
        noisy = table(state, Sensors(tip_mm=NOISE_MM), "tip", made.machine, np.random.default_rng(3))
        write_log(log, noisy)
    return recut.misses_um(state, run, recut.driven(original))


def corrected(lathe, program, *options):
    """The text of a corrected program."""
    source, out = lathe.folder / "in.nc", lathe.folder / "out.nc"
    source.write_text(program)
    calm = str(CONFIG / "no-force.yaml")
    say = ["compensate", str(source), *map(str, options), "--config", calm, "-o", str(out), "--tolerance-um", "3"]
    code, said = runner.invoke(say)
    assert code == 0, said
    return out.read_text()


def in_four_digits(formula):
    """A formula as it is reported."""
    return re.sub(r"\d+\.\d{3,}", lambda number: f"{float(number[0]):.4g}", formula)


@pytest.mark.campaign
def test_the_law_stands_in_the_result(lathe):
    cause = lathe.result["causes"][-1]
    law = cause["law"]
    assert lathe.result["verdict"] == "unknown" and cause["effect"] == "unknown"
    period = lathe.made.fault.parameters["period_mm"]
    assert [each["term"].split(":")[0] for each in law["terms"]] == ["tip x", "tip x"]
    assert {each["term"].split("(")[0] for each in law["terms"]} == {"tip x: sin", "tip x: cos"}
    found = float(law["terms"][0]["term"].split("/")[1].rstrip(")"))
    assert found == pytest.approx(period, rel=0.02)
    sine, cosine = (each["value"] for each in law["terms"])
    assert np.hypot(sine, cosine) == pytest.approx(0.03 * lathe.made.size, rel=0.1)
    assert all(
        low < each["value"] < high and each["unit"] == "mm" for each in law["terms"] for low, high in [each["ci95"]]
    )
    assert law["on"] == "structure" and set(law["envelope"]) == {"y_mm"}
    assert lathe.result["where"]["stage"] == law["on"]
    assert law["before_rms_um"] > 40.0 and law["after_rms_um"] < 0.25 * law["before_rms_um"]
    assert "repeats over y_mm" in lathe.said and in_four_digits(law["formula"]) in lathe.said


def test_compensated_with_the_law_the_machine_cuts_true_at_once(lathe):
    entry = yaml.safe_load(lathe.better.read_text())["effects"][-1]
    assert (entry["effect"], entry["stage"], entry["axis"]) == ("formula", "structure", "x")
    for program in (PART, OTHER_PART, OTHER_FEED):
        before = cut(lathe, program, program)
        after = cut(lathe, corrected(lathe, program, "--config", lathe.better), program)
        assert before > 20.0 and after < ENOUGH_UM, (before, after)


def cuts_needed(lathe, program, logs):
    """How many test cuts the mirror technique needs for a program in addition to existing logs: each adds its own."""
    plain, count = ["--config", lathe.made.machine.config], 0
    while True:
        now = corrected(lathe, program, *plain, *(o for log in logs for o in ("--mirror", log))) if logs else program
        log = lathe.folder / f"cut-{lathe.cuts}.csv"
        if cut(lathe, now, program, log) < ENOUGH_UM:
            return count
        logs.append(log)
        count += 1
        assert count < 4


def test_the_mirror_needs_a_test_cut_for_every_part(lathe):
    logs = []
    assert 1 <= cuts_needed(lathe, PART, logs) <= 2
    assert 1 <= cuts_needed(lathe, OTHER_PART, []) <= 2
    source = lathe.folder / "in.nc"
    source.write_text(OTHER_PART)
    options = ["--config", str(lathe.made.machine.config), "--mirror", str(logs[0])]
    code, said = runner.invoke(["compensate", str(source), *options])
    assert code == 2 and "CC406" in said


def test_a_log_of_something_else_is_no_test_cut(lathe):
    source, log = lathe.folder / "in.nc", lathe.folder / "bad.csv"
    source.write_text(PART)
    for text, rule in (("t_s,x_mm\n0,1\n", "CC401"), ("t_s,x_mm,y_mm,z_mm\n0,1,1,1\n", "CC404")):
        log.write_text(text)
        options = ["--config", str(lathe.made.machine.config), "--mirror", str(log)]
        code, said = runner.invoke(["compensate", str(source), *options])
        assert code == 2 and rule in said
    far = "".join(f"{i},{i + 500},700,90\n" for i in range(30))
    log.write_text("t_s,x_mm,y_mm,z_mm\n" + far)
    code, said = runner.invoke(["compensate", str(source), *options])
    assert code == 2 and "CC406" in said


@pytest.mark.campaign
def test_the_next_machine_starts_with_what_was_learned(lathe, tmp_path):
    code, said = runner.invoke(["effects", "--library", str(lathe.library)])
    assert code == 0 and lathe.result["causes"][-1]["law"]["formula"] in said
    same = ["diagnose", str(lathe.folder / "runs" / "experiment.yaml"), "--library", str(lathe.library)]
    out, better = tmp_path / "again.json", tmp_path / "better.yaml"
    code, said = runner.invoke([*same, "--json", str(out), "--write-config", str(better)])
    assert code == 0, said
    found = json.loads(out.read_text())
    name = next(lathe.library.glob("law_*.json")).stem
    assert found["verdict"] in ("identified", "ambiguous")  # what the wave swings about may be an offset or a pitch
    assert all(name in [each["effect"] for each in one] for one in [found["causes"], *found["alternatives"]])
    law = next(each for each in found["causes"] if each["effect"] == name)
    assert law["probability"] > 0.9 and law["share"] > 0.8
    for each in law["parameters"].values():
        assert each["value"] == pytest.approx(1.0, abs=0.15)
    entries = yaml.safe_load(better.read_text())["effects"]
    assert [each["effect"] for each in entries].count("formula") == 2
    assert runner.invoke(["validate", str(better)])[0] == 0


def test_a_library_that_cannot_be_read_is_told(tmp_path):
    (tmp_path / "law_x.json").write_text('{"name": "law_x"}')
    code, said = runner.invoke(["effects", "--library", str(tmp_path)])
    assert code == 2 and "law_x.json:1:1: error[CC292]" in said


def test_the_report_draws_the_law_over_what_it_explains(lathe):
    law, page = lathe.result["causes"][-1]["law"], lathe.report.read_text()
    assert in_four_digits(law["formula"]) in page and "What is left of tip x over y_mm" in page
    assert "the law, fitted to the other runs" in page and "Gap of every run without and with the law" in page
