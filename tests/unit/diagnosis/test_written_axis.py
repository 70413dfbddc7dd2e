"""The residual of an unseen run with the written machine file is the claimed one, sizes of every axis included."""

import numpy as np
import pytest
import yaml

from camcomp.api.diagnosis import diagnose

MACHINE = {"robot": {"name": "joint", "type": "serial", "convention": "dh", "joints": [{"name": "M", "a_mm": 500}]}}
LAG, INERTIA, RUBS, SAGS, ZERO, NOISE = 0.03, 4e-4, 4e-4, 2e-3, 6e-4, 2e-4  # s, s2, rad


def log(folder, name, seed, late):
    """A joint behind a first-order loop, whose inertia, friction, weight and zero show in its encoder."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, 8.0, 0.004)
    waves = [(a, w, rng.uniform(0.0, 6.0)) for a, w in ((0.6, 0.9), (0.3, 2.6), (0.08, 7.0))]
    asked = sum(a * np.sin(w * t + p) for a, w, p in waves)
    steady = sum(a * np.exp(1j * (w * t + p)) / (1.0 + 1j * w * late) for a, w, p in waves).imag
    speed = np.gradient(steady, t)
    more = ZERO - RUBS * np.sign(speed) - INERTIA * np.gradient(speed, t) - SAGS * np.cos(steady)
    encoder = steady + more + NOISE * rng.standard_normal(len(t))
    rows = np.column_stack([t, asked, encoder])
    np.savetxt(folder / f"{name}.csv", rows, fmt="%.9g", delimiter=",", header="t_s,cmd_M_rad,act_M_rad", comments="")


def diagnosed(folder, config):
    entries = [{"name": each, "log": f"{each}.csv", "cutting": False} for each in ("fitted", "unseen")]
    path = folder / "experiment.yaml"
    path.write_text(yaml.safe_dump({"config": [config], "runs": entries, "holdout": ["unseen"]}))
    return diagnose(path)


@pytest.mark.parametrize("late", [0.0, LAG])
def test_the_written_file_leaves_what_is_claimed(tmp_path, late):
    (tmp_path / "joint.yaml").write_text(yaml.safe_dump(MACHINE))
    for seed, name in enumerate(("fitted", "unseen")):
        log(tmp_path, name, seed, late)
    found = diagnosed(tmp_path, "joint.yaml")
    claim = found.result.shrinkage.actuators["M"]
    (tmp_path / "written.yaml").write_text(found.machine_with_causes(str(tmp_path / "written.yaml")))
    again = diagnosed(tmp_path, "written.yaml").result.shrinkage.actuators["M"]
    assert claim.after_rms < 0.5 * claim.before_rms
    assert again.before_rms == pytest.approx(claim.after_rms, rel=0.03)
