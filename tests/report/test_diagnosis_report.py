"""The diagnosis report: what it says, what it draws, and that all of it stands in a real browser."""

import dataclasses
import json
import re
from base64 import b64decode
from hashlib import sha256
from html import unescape

import numpy as np
import pytest

from camcomp.diagnosis.report.figures import figure_map, figure_signed, figure_size
from camcomp.diagnosis.report.page import diagnosis_html, verdict_text
from camcomp.diagnosis.report.run_view import rms
from camcomp.diagnosis.result.types import DiagnosisResult
from camcomp.report.inputs import Input
from camcomp.report.page import Listing
from camcomp.terminal.cli import run
from tests.commandline import ROOT
from tests.report.browser import needs_browser
from tests.report.diagnoses import result, run_view, views

VERDICTS = ("none", "identified", "ambiguous", "unknown")


def html_of(verdict, **more):
    made = diagnosis_html(
        result(verdict), views(), title="e.yaml", machine="Orthoglide", **more,
    )  # fmt: skip
    return made.decode()


def words(html):
    body = re.sub(r"<(script|style)[ >].*?</\1>", " ", html, flags=re.DOTALL)
    return re.sub(r"\s+", " ", unescape(re.sub(r"<[^>]*>", " ", body)).replace("\u00a0", " "))


def figures(html):
    data = re.search(r'<script type="application/json" id="figures">(.*?)</script>', html, re.DOTALL)[1]
    return {each["name"]: each for each in json.loads(data)}


@pytest.mark.parametrize(
    ("verdict", "told"),
    [
        ("none", "nothing to explain"),
        (
            "identified",
            "backlash (x) and gravity explain the gap. On runs that the fit has not seen the gap goes from 14.1 µm",
        ),
        ("ambiguous", "cannot tell apart: backlash (x); or friction (x) and gravity."),
        (
            "unknown",
            "no effect of the library explains. gravity is identified. The rest of y depends on the reversals of x.",
        ),
    ],
)
def test_the_verdict_is_a_sentence(verdict, told):
    assert told in verdict_text(result(verdict))


def test_what_may_be_a_part_of_something_unknown_is_not_called_identified():
    unknown = result("unknown")
    causes = tuple(c.model_copy(update={"probability": min(c.probability, 0.5)}) for c in unknown.causes)
    told = verdict_text(unknown.model_copy(update={"causes": causes}))
    assert "explains. gravity may be a part of it. It moves y and depends on the reversals of x." in told


def test_causes_with_intervals_next_experiment_and_notes():
    text = words(html_of("ambiguous", notes=["run b has no temperature"]))
    assert "backlash (x): play in the drive" in text and "width 21.3 µm (19.2 to 23.4) 97.0 % 90 %" in text
    assert "Repair nothing yet" in text and "play in the drive" in text
    assert (
        "Mill the circle in air at 2000 mm/min. It separates backlash(x) and friction(x): 0.830 bits expected." in text
    )
    assert "run b has no temperature" in text
    # 14.1 um become 3.525 um: three quarters are gone
    assert "Part of the gap removed 75.0 % 95 % interval 70.0 to 90.0 %" in text
    assert "75.0 % of the gap goes (95 % interval 70.0 to 90.0 %)." in text


def test_held_out_runs_are_drawn_the_worst_first():
    drawn = figures(html_of("identified"))
    assert [name for name in drawn if name.startswith("time-")] == ["time-1", "time-2"]
    first = drawn["time-1"]["traces"]
    assert [each["name"] for each in first[:2]] == ["tip x, before", "tip x, with the causes found"]
    assert [min(first[0]["y"]), max(first[0]["y"])] == pytest.approx(
        [views()[1].before[:, 0].min(), views()[1].before[:, 0].max()], abs=1e-3
    ), "with its sign"
    sizes = drawn["path-1"]["traces"]
    assert [each["name"] for each in sizes] == ["before", "with the causes found", "noise floor"]
    assert max(sizes[0]["y"]) == pytest.approx(np.nanmax(views()[1].sizes[0]), abs=1e-3)
    assert max(sizes[1]["y"]) == pytest.approx(np.nanmax(views()[1].sizes[1]), abs=1e-3)
    assert set(sizes[2]["y"]) == {0.87}
    path = sizes[0]["x"]
    assert path[-1] == pytest.approx(2 * np.pi * 25, rel=1e-4)
    ladder = drawn["ladder"]["traces"][0]
    assert ladder["y"] == ["+ gravity", "+ backlash (x)", "as it was"] and ladder["x"][-1] == 14.1


def test_without_held_out_runs_those_of_the_fit_are_drawn_and_called_so():
    html = diagnosis_html(result("identified"), [run_view("c", False)], title="e", machine="m").decode()
    assert "Run c: gap along the time" in words(html) and "This run was used for the fit." in words(html)


def test_the_map_has_one_scale_for_before_and_after():
    before, after = figures(html_of("identified"))["map"]["traces"]
    assert before["marker"]["cmax"] == after["marker"]["cmax"] > 0
    assert before["x"] == after["x"] and max(before["marker"]["color"]) > 5 * np.mean(after["marker"]["color"])


def test_a_result_without_gap_draws_no_ladder():
    drawn = figures(html_of("none"))
    assert "ladder" not in drawn and "time-1" in drawn


def test_rows_without_measurement_are_gaps():
    view = run_view("a", True)
    view.before[100:200] = np.nan
    drawn = figures(diagnosis_html(result("none"), [view], title="e", machine="m").decode())
    assert drawn["time-1"]["traces"][0]["y"].count(None) == 100


def test_inputs_stand_without_their_folders():
    html = html_of("identified", inputs=[Input("log", "/home/me/a.csv", b"1")])
    assert "/home/me" not in html and "log a.csv 1 6b86b273ff34fce1" in words(html)


def test_vibrations_stand_in_a_table():
    found = result("identified")
    shake = {"axis": "z", "hertz": 12.5, "amplitude_um": 4.2, "share": 0.31}
    where = found.where.model_validate(found.where.model_dump() | {"frequencies": [shake]})
    html = diagnosis_html(found.model_copy(update={"where": where}), [], title="e", machine="m").decode()
    assert "z 12.5 4.20 31.0 %" in words(html)


def test_rows_without_a_value_do_not_count():
    assert rms(np.array([np.nan, 3.0, -3.0])) == 3.0 and rms(np.array([np.nan])) == 0.0


@pytest.fixture(scope="session")
def diagnosed(tmp_path_factory):
    """A sample experiment as a newcomer runs it: (result, page)."""
    folder = tmp_path_factory.mktemp("diagnosed")
    experiment = ROOT / "samples/diagnosis/clear/experiment.yaml"
    words = ["diagnose", experiment, "--json", folder / "r.json", "--report", folder / "r.html"]
    assert run([str(each) for each in words]) == 0
    return json.loads((folder / "r.json").read_text()), (folder / "r.html").read_text(encoding="utf-8")


def test_runs_that_are_drawn_shrink_as_the_result_says(diagnosed):
    found, html = diagnosed
    maps = figures(html)["map"]["traces"]
    drawn = [np.sqrt(np.mean(np.square(np.array(each["marker"]["color"], float)))) for each in maps]
    shrink = found["shrinkage"]
    assert drawn == pytest.approx([shrink["before_rms_um"], shrink["after_rms_um"]], rel=0.02)
    assert shrink["ratio"] == pytest.approx(1 - shrink["after_rms_um"] / shrink["before_rms_um"], abs=1e-4)
    assert f"{100 * shrink['ratio']:.1f} % of the gap goes" in words(html)


def test_a_diagnosis_names_all_its_files(diagnosed):
    text = words(diagnosed[1])
    for path in sorted((ROOT / "samples/diagnosis/clear").iterdir()):
        assert sha256(path.read_bytes()).hexdigest() in text, path.name
    assert str(ROOT) not in diagnosed[1] and "Identified. backlash (y) explains the gap." in text


@needs_browser
@pytest.mark.parametrize(
    "verdict", [pytest.param(each, marks=() if each == "ambiguous" else pytest.mark.campaign) for each in VERDICTS]
)
def test_in_a_browser(browser, tmp_path, verdict):
    path = tmp_path / "d.html"
    path.write_text(html_of(verdict), encoding="utf-8")
    browser.console()
    browser.open(path)
    drawn = browser.run(
        "return [...document.querySelectorAll('.plot')].map(p => [p.id, p.dataset.drawn,"
        " p.querySelectorAll('path.js-line, .bars path, path.point').length])"
    )
    assert len(drawn) == {"none": 6, "identified": 7, "ambiguous": 7, "unknown": 7}[verdict]
    for name, done, marks in drawn:
        assert done == "yes" and marks, name
    assert browser.console() == []
    labels = browser.run("return [...document.querySelectorAll('.plot')].map(p => p.ariaLabel)")
    assert len(set(labels)) == len(labels) and all(len(each) > 30 for each in labels)


def test_the_next_program_stands_on_the_page_ready_to_be_saved():
    html = html_of("ambiguous", next_program=Listing("next-experiment.nc", "G0 X1 <\nM2\n"))
    assert '<pre tabindex="0">G0 X1 &lt;\nM2\n</pre>' in html
    (data,) = re.findall(r'download="next-experiment.nc" href="data:text/plain;base64,([^"]+)"', html)
    assert b64decode(data) == b"G0 X1 <\nM2\n"


def test_the_first_part_says_what_to_do():
    text = words(html_of("identified"))
    at = [
        text.index(each) for each in ("What to do What stays after a repair", "adjust the preload", "Shrinkage ladder")
    ]
    assert at == sorted(at)
    assert "Nothing: machine and model agree" in words(html_of("none"))
    unknown = words(html_of("unknown"))
    assert "none of the effects that camcomp knows" in unknown
    assert re.search(r"unknown \(y\): none of the effects of the library \d+\.\d % \d+ %", unknown)


def test_where_no_cause_takes_anything_no_curve_says_so():
    """Before and after are the same then: a second curve on top of the first would look like a result."""
    one, *_ = views()
    bare = dataclasses.replace(one, after=one.before)
    assert [each["name"] for each in figure_size(bare, 1, 0.87).traces] == ["before", "noise floor"]
    assert "no cause found takes any of it" in figure_size(bare, 1, 0.87).caption
    assert len(figure_map([bare]).traces) == 1 and len(figure_map([one]).traces) == 2
    assert not any("with the causes found" in each["name"] for each in figure_signed(bare, 1).traces)


def test_the_law_of_an_unknown_effect_stands_on_the_first_screen():
    term = {"term": "x_mm", "value": 0.02, "ci95": [0.01, 0.03], "unit": "1/mm"}
    law = {"formula": "tip y = 0.02*x_mm", "on": "structure", "terms": [term], "envelope": {"x_mm": [-20, 20]},
           "after_rms_um": 2.9, "before_rms_um": 17.4, "says": "What is left rises evenly with x_mm."}  # fmt: skip
    unknown = {"effect": "unknown", "target": "y", "probability": 0.99, "share": 0.9, "parameters": {}, "law": law}
    found = DiagnosisResult.model_validate(result("unknown").model_dump() | {"causes": [unknown]})
    text = words(diagnosis_html(found, [], title="e", machine="m").decode())
    first = text[: text.index("It changes nothing in the verdict")]
    assert "2.90 µm was 17.4 µm" in first and "83.3 %" in first and "rises evenly with x_mm" in first
