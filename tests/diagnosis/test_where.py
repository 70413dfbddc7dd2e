"""Where the gap lies, against machines whose fault is known: actuator, axis and frequency."""

import pytest

from tests.diagnosis.conftest import plan_of

VIBRATION = plan_of(("floor_vibration", "x"), samples=150)


@pytest.fixture(scope="module")
def where(workshop):
    return lambda plan: workshop.answer(plan)[0]["where"]


@pytest.mark.campaign  # a screw is in the plain run (test_loop)
def test_a_vibration_shows_at_its_axis_and_frequency(workshop, where):
    truth = dict(workshop.made(VIBRATION)[1].truth.foreign)["floor_vibration"]
    found = where(VIBRATION)
    assert [line["axis"] for line in found["frequencies"]] == ["x"]
    line = found["frequencies"][0]
    assert line["hertz"] == pytest.approx(truth["hertz"], rel=0.02)
    assert line["amplitude_um"] == pytest.approx(30.0 * truth["size"], rel=0.15)
    assert max(found["axes"], key=found["axes"].get) == "x"
    assert found["drivers"][0]["covariate"] == "time:x"
