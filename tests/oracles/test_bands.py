"""Machines drawn from the stated spreads, judged by the energy plant: do the bands hold what they promise?

`python -m pytest tests/oracles/test_bands.py -m campaign` draws 500 machines per case; a few stand in for them otherwise.
"""

from dataclasses import replace

import numpy as np
import pytest

from camcomp.compensation.program.compensate import compensate
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.control import program_of
from camcomp.model.job import Job
from tests.validation.plants import energy
from tests.validation.plants.legs import orthoglide
from tests.validation.plants.machine import ORIGIN

RADIUS = 25.0
PROGRAM = b"G21 G90 G17\nG0 X25 Y0 Z5\nG1 Z0 F300\nG3 X25 Y0 I-25 J0 F600\nG1 Z5 F1000\n"
FOOT = np.array([1.5e-4, 1.0e-4, 1.0e-4, 1.0e-7, 2.0e-7, 2.0e-7])
TRIPLE = np.array([215.0, -10.0, -25.0])
SMALL = {"force": 0.15, "drive": 0.1, "foot": 0.1, "bars": 0.07, "roll": 0.05}
LARGE = {"force": 0.3, "drive": 0.3, "foot": 0.3, "bars": 0.2, "roll": 0.1}
DOUBTED = {"force": 0.33, "drive": 0.1, "foot": 0.1, "bars": 0.1, "roll": 0.05, "lean": 0.0}  # little of it is sure


def spread(value, sd, group=""):
    return f"{{value: {value}, sd: {abs(sd):.9g}{', group: ' + group if group else ''}}}"


def config(tmp_path, sizes, policy="full"):
    """The sample machine whose force, drives, feet, bars and rolls (deg) have these deviations."""
    text = shipped("config/orthoglide-1deg.yaml").read_text()

    def put(old, new, count):
        nonlocal text
        assert text.count(old) == count, old
        text = text.replace(old, new)

    put("stiffness_N_per_mm: 1.0e+4", f"stiffness_N_per_mm: {spread(1e4, 1e4 * sizes['drive'])}", 1)
    put("E_N_per_mm2: 70000", f"E_N_per_mm2: {spread(70000, 70000 * sizes['bars'])}", 1)
    put("rotation_deg: [1, 0, 0]", f"rotation_deg: [{spread(sizes.get('lean', 1.0), sizes['roll'])}, 0, 0]", 3)
    for name, part in (("translation_mm_per_N", FOOT[:3]), ("rotation_rad_per_Nmm", FOOT[3:])):
        at = text.index(name)
        end = text.index("]", at) + 1
        text = text[:at] + f"{name}: [{', '.join(spread(v, v * sizes['foot'], 'feet') for v in part)}]" + text[end:]
    forces = ", ".join(
        f"{key}: {spread(v, v * sizes['force'], group)}"
        for key, v, group in zip(("Fr_N", "Ft_N", "Fz_N"), TRIPLE, ("", "rest", "rest"), strict=True)
    )
    at = text.index("{model: constant")
    text = text[:at] + f"{{model: constant, {forces}}}" + text[text.index("}", at) + 1 :]
    path = tmp_path / "machine.yaml"
    path.write_text(text + f"\n  policy: {policy}\n")
    return load_config([path])


def compensated(tmp_path, sizes, policy="full"):
    cfg = config(tmp_path, sizes, policy)
    job = Job(cfg)
    program = program_of(PROGRAM, "circle.nc", cfg)
    return compensate(program, job, method="newton", tolerance_um=1.0, version="0")


def on_the_circle(result, count):
    """`count` end points of the circle: rows, programmed and commanded tips."""
    rows = np.flatnonzero((result.rows.motion == 2) & ~result.rows.joining)
    rows = rows[np.linspace(0, len(rows) - 2, count).astype(int)]
    return rows, result.rows.target[rows], result.written.end[rows]


def machines(sizes, count, seed):
    """Drawn machines: legs, and the factors of Fr and of Ft and Fz."""
    random = np.random.default_rng(seed)
    for _ in range(count):
        drive, foot, bars = 1.0 + np.array([sizes["drive"], sizes["foot"], sizes["bars"]]) * random.standard_normal(3)
        roll = sizes.get("lean", 1.0) + sizes["roll"] * random.standard_normal(3)
        legs = orthoglide(roll_deg=tuple(roll), drive_factor=(drive,) * 3)
        legs = replace(legs, foot=np.diag(1.0 / (FOOT * foot)), bar=bars * legs.bar)
        radial, rest = 1.0 + sizes["force"] * random.standard_normal(2)
        yield legs, np.array([radial, rest, rest])


def errors(legs, factors, target, commanded):
    """Errors (n, 3) mm of a drawn machine at commanded tips; the groove decides the force."""
    out = target[:, :2] / RADIUS
    zero, one = np.zeros(len(out)), np.ones(len(out))
    right = np.column_stack((out, zero))
    along = np.column_stack((-out[:, 1], out[:, 0], zero))
    up = np.column_stack((zero, zero, one))
    fr, ft, fz = TRIPLE * factors
    rho = energy.inverse(orthoglide(), commanded + ORIGIN)
    return energy.settle(legs, rho, fr * right + ft * along + fz * up).tip - ORIGIN - target


def judged(result, sizes, count, points, seed):
    """Errors (m, n) um before and after of drawn machines, and the rows they stand at."""
    rows, target, commanded = on_the_circle(result, points)
    before, after = [], []
    for legs, factors in machines(sizes, count, seed):
        before.append(1e3 * np.linalg.norm(errors(legs, factors, target, target), axis=1))
        after.append(1e3 * np.linalg.norm(errors(legs, factors, target, commanded), axis=1))
    return np.array(before), np.array(after), rows


def held(result, before, after, rows):
    """Shares of drawn machines inside the 90 % band, and at least as good as the 90 % gain says."""
    inside = after <= result.bands.band_um(0.9)[rows]
    better = before - after >= result.bands.gain_um(0.9)[rows]
    return inside.mean(), better.mean()


@pytest.fixture(scope="module")
def some(tmp_path_factory):
    """A program compensated under small spreads, run on a hundred machines."""
    result = compensated(tmp_path_factory.mktemp("machine"), SMALL)
    return result, *judged(result, SMALL, 100, 5, 1)


def test_bands_hold_on_some_drawn_machines(some):
    inside, better = held(*some)
    assert 0.86 <= inside <= 0.94 and 0.83 <= better <= 0.96, (inside, better)


def test_what_is_expected_of_the_program_is_what_drawn_machines_do(some):
    result, _, after, _ = some
    expected = result.bands.totals.expected()
    rms = np.sqrt((after**2).mean(axis=1))
    assert expected.rms_um == pytest.approx(np.sqrt((after**2).mean()), rel=0.1)
    assert expected.p95_um == pytest.approx(np.quantile(after, 0.95), rel=0.15)
    assert 0.9 <= ((expected.rms_ci95_um[0] <= rms) & (rms <= expected.rms_ci95_um[1])).mean()


@pytest.mark.campaign
@pytest.mark.parametrize("sizes", [SMALL, LARGE], ids=["small", "large"])
def test_bands_hold_on_500_drawn_machines(tmp_path, sizes):
    result = compensated(tmp_path, sizes)
    before, after, rows = judged(result, sizes, 500, 12, 11)
    inside, better = held(result, before, after, rows)
    print(f"90 % band holds {inside:.3f}, 90 % gain {better:.3f}")
    assert 0.87 <= inside <= 0.93 and 0.86 <= better <= 0.94, (inside, better)
    assert result.bands.totals.expected().rms_um == pytest.approx(np.sqrt((after**2).mean()), rel=0.08)
    assert result.bands.totals.expected().p95_um == pytest.approx(np.quantile(after, 0.95), rel=0.08)


def worse(result, sizes, count, points, seed):
    """Share of drawn machines that leave more with the corrected program than with the original one.

    Beyond the tolerance of 1 um, which an arc in straight lines may cost even where hardly anything is corrected.
    """
    before, after, _ = judged(result, sizes, count, points, seed)
    return (np.sqrt((after**2).mean(axis=1)) > np.sqrt((before**2).mean(axis=1)) + 1.0).mean()


def test_a_shrunk_correction_harms_hardly_any_machine(tmp_path):
    """The full correction harms some four in a hundred of these machines."""
    result = compensated(tmp_path, DOUBTED, "shrink")
    assert result.bands.totals.shrunk > 0
    assert worse(result, DOUBTED, 60, 4, 21) <= 0.02
    assert worse(compensated(tmp_path, DOUBTED), DOUBTED, 60, 4, 21) > 0.02, "what shrinking is held to"


@pytest.mark.campaign
@pytest.mark.parametrize("sizes", [SMALL, LARGE, DOUBTED], ids=["small", "large", "doubted"])
def test_a_shrunk_correction_harms_less_than_one_machine_in_a_hundred(tmp_path, sizes):
    share = worse(compensated(tmp_path, sizes, "shrink"), sizes, 500, 8, 31)
    print(f"worse off: {share:.3f}")
    assert share <= 0.01
