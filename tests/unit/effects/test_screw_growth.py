"""A screw that grows along the length in use: by definition, beside what is like it, and taken out of a program."""

import numpy as np
import pytest

from camcomp.ground import shelf
from camcomp.ground.errors import ConfigError
from camcomp.model.config.load import load_config
from camcomp.model.effect import Motion, nominal
from tests.validation import runner
from tests.validation.plants.slides import Axes, experiment


def drive(name, motion, **p):
    effect = shelf.load("effects", name)
    return effect.on_drive(np.zeros_like(motion.encoder), motion, np.ones(1), {**nominal(effect), **p})[:, 0]


def travel(temperature):
    x = np.linspace(-350.0, -250.0, 101)[:, None]
    t, zero = np.linspace(0.0, 5.0, 101), np.zeros((101, 1))
    heat = None if temperature is None else np.full(101, temperature)
    return Motion(
        time=t,
        common=200.0 + t,
        cut_min=t,
        temperature=heat,
        encoder=x,
        speed=zero,
        direction=zero,
        home=np.array([-300.0]),
        stiffness=np.array([1e4]),
    )


def test_it_is_the_warmth_times_the_way_from_home():
    cold, warm = travel(20.0), travel(28.0)
    assert not drive("screw_growth", cold, expansion_ppm_per_K=12.0).any()
    error = drive("screw_growth", warm, expansion_ppm_per_K=12.0)
    assert error[[0, 50, 100]] == pytest.approx([-0.0048, 0.0, 0.0048])
    # at one temperature nobody can tell it from a pitch, and a mm from home it is what grows alike everywhere
    assert error == pytest.approx(drive("screw_pitch", warm, error_ppm=96.0))
    rise = -10.0 * np.expm1(-200.0 / 3600.0)
    assert drive("screw_growth", travel(None), expansion_ppm_per_K=12.0)[0] == pytest.approx(-12e-6 * rise * 50.0)


def test_a_hinge_has_no_screw(tmp_path):
    for target in ("target: A1, ", ""):
        (tmp_path / "more.yaml").write_text(f"effects: [{{effect: screw_growth, {target}expansion_ppm_per_K: 10}}]\n")
        with pytest.raises(ConfigError) as refused:
            load_config(["config/kuka-kr210.yaml", tmp_path / "more.yaml"])
        assert refused.value.rule == "CC205" and "'A1' is a hinge" in refused.value.message


def test_a_warm_program_stops_short_by_what_the_screw_grows(tmp_path):
    """At 30 degrees X400 is commanded where a screw longer by 120 ppm carries the nut to 400 mm."""
    (tmp_path / "in.nc").write_text("G21 G90 G17 G94\nG0 X0 Y0 Z0\nG1 X400 F6000\nM2\n")
    more = "effects: [{effect: screw_growth, target: x, expansion_ppm_per_K: 12}]\nprocess: {temperature_C: 30, force: {model: none}}\n"
    (tmp_path / "more.yaml").write_text(more)
    files = ["--config", "config/cartesian.yaml", "--config", str(tmp_path / "more.yaml")]
    out = tmp_path / "out.nc"
    code, said = runner.invoke(["compensate", str(tmp_path / "in.nc"), *files, "-o", str(out)])
    assert code == 0, said
    x = [float(word[1:]) for word in out.read_text().split() if word.startswith("X")]
    assert x[-1] == pytest.approx(400.0 / (1.0 + 120e-6), abs=1e-3)


MOVES = "G0 X0 Y0 Z0\nG1 X400 F15000\nY400\nX300 Y200\nX0\nY0\n"


@pytest.mark.campaign  # test_every_machine has one in the plain run
def test_it_is_found_and_is_neither_a_pitch_nor_a_growth_everywhere(tmp_path):
    """A screw of 12 ppm per kelvin carries the nut beyond its scale, from 20 to 26 degrees over an hour."""

    def moved(common, asked):
        heat = 26.0 - 6.0 * np.exp(-common / 1500.0)
        tip = asked.copy()
        tip[:, 0] *= 1.0 + 12e-6 * (heat - 20.0)
        return Axes(asked, tip, heat=heat)

    result = runner.ask(experiment(tmp_path, [(MOVES, 0.0), (MOVES, 900.0), (MOVES, 3600.0)], moved))
    [cause] = result["causes"]
    assert (result["verdict"], cause["effect"], cause["target"]) == ("identified", "screw_growth", "x")
    low, high = cause["parameters"]["expansion_ppm_per_K"]["ci95"]
    assert low <= 12.0 <= high and high - low < 3.0
