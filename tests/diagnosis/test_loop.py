"""The loop closes: diagnose, write the causes into the machine file, compensate with it, and the broken machine cuts true."""

import pytest

from camcomp.api.diagnosis import machine_with_causes
from tests.diagnosis.conftest import plan_of
from tests.validation import runner
from tests.validation.plants.experiments import rerun
from tests.validation.plants.measure import path_error

SCREW = plan_of(("screw_cyclic", "y"), samples=150)
PAIR = plan_of(("drive_stiffness", "y"), ("cutting_force", None), ratio=30.0, seed=42)


EITHER = pytest.mark.parametrize(
    "plan", [pytest.param(SCREW, id="single"), pytest.param(PAIR, id="pair", marks=pytest.mark.campaign)]
)


def test_a_screw_that_runs_out_shows_at_its_actuator_and_is_no_vibration(workshop):
    found = workshop.answer(SCREW)[0]["where"]
    assert max(found["actuators"], key=found["actuators"].get) == "y"
    assert found["frequencies"] == []


@EITHER
def test_steps_lead_from_the_gap_to_near_the_floor(workshop, plan):
    result = workshop.answer(plan)[0]
    found = result["shrinkage"]
    sizes = [found["before_rms_um"], *(step["after_rms_um"] for step in found["steps"])]
    assert len(found["steps"]) == len([c for c in result["causes"] if c["effect"] != "unknown"])
    assert sizes == sorted(sizes, reverse=True) and sizes[-1] == found["after_rms_um"]
    assert found["noise_floor_um"] == result["gap"]["noise_floor_um"]
    assert found["after_rms_um"] < 1.8 * found["noise_floor_um"]
    assert found["refitted"] == []


@EITHER
def test_the_corrected_program_shrinks_the_error_as_predicted(workshop, tmp_path, plan):
    path, made = workshop.made(plan)
    result, better = workshop.answer(plan)[0], tmp_path / "better.yaml"
    better.write_text(
        machine_with_causes(
            [str(path.parent / "machine.yaml")], workshop.answer(plan)[1].result, str(better), actuators=("x", "y", "z")
        )
    )
    assert "# found by camcomp diagnose" in better.read_text()
    program = next(p for p, r in zip(made.programs, made.runs, strict=True) if r.cutting and "G3" in p)
    (tmp_path / "in.nc").write_text(program)

    def left(config):
        out = tmp_path / "out.nc"
        code, said = runner.invoke(["compensate", str(tmp_path / "in.nc"), "--config", str(config), "-o", str(out)])
        assert code == 0, said
        return path_error(rerun(made, out.read_text(), program), program)

    before, after = left(runner.CONFIG), left(better)
    assert before > 0.008
    shrinkage = result["shrinkage"]
    assert 1.0 - after / before > shrinkage["ratio"] - 0.05  # that ratio has the noise of the tracker in it
    assert 1e3 * after < 1.5 * shrinkage["after_rms_um"]
