"""The model of every log against closed forms: evidence as the density of a normal distribution, search, discrepancy, folds."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from camcomp.diagnosis.model.calibration import CalibrationMap
from camcomp.diagnosis.model.candidates import AmplitudeBounds, PlacedCause
from camcomp.diagnosis.model.classes import alternatives_of
from camcomp.diagnosis.model.discrepancy import covariate_columns, smooth_functions
from camcomp.diagnosis.model.evidence import WIDTHS, Background, LinearModel
from camcomp.diagnosis.model.explain import KnownNoise, explain
from camcomp.diagnosis.model.folds import excess_of, folds_of
from camcomp.diagnosis.model.group import Group, SmoothProcess
from camcomp.diagnosis.model.noise import resolution_of
from camcomp.diagnosis.model.verdict import decide
from tests.validation.calibration import fit_map

SD = 0.02


def model(rng, amounts=(), more=None, groups=2, n=60, sd=SD, seen=SD):
    """Groups with columns sin(k x), constants as nuisances, and one covariate; more(x): what no column is."""
    out = []
    for g in range(groups):
        x = np.sort(rng.uniform(0.0, 6.0, n))
        A = np.stack([np.sin((k + 1) * x) for k in range(6)], axis=1)[:, None, :]
        y = A[:, 0] @ np.pad(np.array(amounts, float), (0, 6 - len(amounts))) + rng.normal(0.0, seen, n) + 0.3 * g
        y = y + (more(x) if more else 0.0)
        B = {"position:x": covariate_columns(smooth_functions(x, 0.0, 6.0), np.full((n, 1, 1), sd))}
        out.append(
            Group(
                name=f"run {g}", label=g, y=y[:, None], A=A, N=np.full((n, 1, 1), 1e-3), sd=np.full((n, 1), sd), B=B,
                position=x[:, None], order=np.linspace(0.0, 1.0, n),
            )
        )  # fmt: skip
    free = SimpleNamespace(low=-10.0, high=10.0, scale=1.0, log=False, sign=0, coordinate=lambda v: v)
    candidates = tuple(PlacedCause("wave", str(k), (k,)) for k in range(6))
    return LinearModel(groups=tuple(out), candidates=candidates, bounds=AmplitudeBounds.of([free] * 6, [False] * 6))


def test_small_errors_are_as_large_as_the_noise_that_acts_lets_them_be():
    m = model(np.random.default_rng(1))
    stated, acting = (1.0 / m.precision(Background(noise=factor))[:6] for factor in (1.0, 4.0))
    assert np.sqrt(acting) == pytest.approx(4.0 * np.sqrt(stated))


@pytest.mark.parametrize("background", [Background(), Background(noise=1.5, scales=(("position:x", 2.0),))])
@pytest.mark.parametrize("members", [(), (1,), (0, 3)])
def test_evidence_is_the_density_of_a_normal_distribution(background, members):
    m = model(np.random.default_rng(1), (0.05,))
    data = m.reduced(background)
    whole = np.concatenate([g.y[:, 0] for g in m.groups])
    D = np.concatenate([m.layout.design(g)[:, 0] for g in m.groups])
    value = []
    for width in WIDTHS:
        variance = np.array(1.0 / m.precision(background))
        variance[m.layout.effects :][variance[m.layout.effects :] < 1e-20] = 0.0
        for i in members:
            variance[i] += (width * data.units[i][0]) ** 2
        C = D @ np.diag(variance) @ D.T + (background.noise * SD) ** 2 * np.eye(len(D))
        value.append(multivariate_normal(np.zeros(len(D)), C).logpdf(whole) + 0.5 * len(D) * np.log(2.0 * np.pi))
    expected = np.log(np.mean(np.exp(np.array(value) - max(value)))) + max(value)
    assert data.value(members) - data.prior(members) == pytest.approx(expected, abs=1e-4)


def test_a_process_is_a_covariance_of_rows():
    m = model(np.random.default_rng(2))
    process = SmoothProcess(2.0, 0.7)
    D = np.concatenate([m.layout.design(g)[:, 0] for g in m.groups])
    C = D @ np.diag(np.where(1.0 / m.precision(Background()) < 1e-20, 0.0, 1.0 / m.precision(Background()))) @ D.T
    n = len(m.groups[0].y)
    for g, group in enumerate(m.groups):
        own = slice(g * n, (g + 1) * n)
        C[own, own] += SD**2 * (np.eye(n) + process.correlation(group.position))
    y = np.concatenate([g.y[:, 0] for g in m.groups])
    expected = multivariate_normal(np.zeros(len(y)), C).logpdf(y) + 0.5 * len(y) * np.log(2.0 * np.pi)
    assert m.reduced(Background(process=process)).none == pytest.approx(expected, abs=1e-3)


def test_a_cause_is_as_large_as_the_rows_say_however_small_the_floor_is():
    m = replace(model(np.random.default_rng(1), (5.0,), sd=1.0), floors=2000.0)  # rows of a deviation of 2000 floors
    assert m.reduced(Background()).estimate((0,))[0] == pytest.approx([5.0], rel=0.05)


def test_causes_are_found_with_intervals_that_hold():
    hits = 0
    for seed in range(20):
        found = explain(model(np.random.default_rng(seed), (0.06, 0.0, -0.04)), KnownNoise())
        assert found.members == (0, 2)
        assert found.unknown < 0.2
        amount, covariance = found.amplitudes()
        hits += sum(abs(amount[j] - v) < 1.96 * covariance[j, j] ** 0.5 for j, v in ((0, 0.06), (2, -0.04)))
    assert 34 <= hits <= 40


def test_noise_alone_has_no_cause_and_nothing_unmodelled():
    found = [explain(model(np.random.default_rng(seed)), KnownNoise()) for seed in range(20)]
    assert sum(each.members == () for each in found) >= 19
    assert sum(each.unknown < 0.5 for each in found) == 20


def test_a_bump_is_a_covariate_that_acts_and_no_cause():
    found = explain(model(np.random.default_rng(3), more=lambda x: 0.15 * (np.abs(x - 2.0) < 0.4)), KnownNoise())
    assert found.unknown > 0.9


def test_more_noise_than_stated_is_unmodelled_and_without_a_floor_is_not():
    loud = model(np.random.default_rng(4), seen=2.0 * SD)
    assert explain(loud, KnownNoise()).unknown > 0.9
    assert explain(loud, None).background.noise == pytest.approx(2.0, rel=0.2)


def test_held_out_squares_are_those_of_the_noise_and_grow_with_a_missing_cause():
    m = model(np.random.default_rng(5), (0.06,), n=200)
    complete, lacking = (excess_of(m, Background(), s, folds_of(m), np.inf) for s in ((0,), ()))
    assert complete.mean == pytest.approx(1.0, abs=0.25)
    assert lacking.mean > 1.3
    assert not complete.above


def test_the_same_column_twice_is_one_class():
    m = model(np.random.default_rng(6), (0.06,))
    twins = [
        Group(name=g.name, label=g.label, y=g.y, A=np.repeat(g.A[:, :, :1], 6, axis=2), N=g.N, sd=g.sd)
        for g in m.groups
    ]  # fmt: skip
    found = explain(LinearModel(groups=tuple(twins), candidates=m.candidates, bounds=m.bounds), KnownNoise())
    assert len(found.members) == 1
    assert len(alternatives_of(found)) == 4


def test_noise_of_a_recording():
    rng = np.random.default_rng(8)
    assert resolution_of(np.round(rng.normal(0.0, 50.0, 200), 1)) == pytest.approx(0.1)
    assert resolution_of(np.round(rng.normal(0.0, 50.0, 200) * 2.0) / 2.0) == pytest.approx(0.5)
    assert resolution_of(rng.normal(0.0, 50.0, 200)) == 0.0


def test_the_calibration_map_rises_and_makes_probabilities_come_true():
    rng = np.random.default_rng(9)
    p = rng.uniform(0.01, 0.999, 400)
    right = rng.random(400) < 0.5 + 0.4 * (p > 0.9)
    found = fit_map(p, right, np.abs(rng.normal(0.0, 1.0, 400)))
    assert list(found.probability) == sorted(found.probability)
    assert found.calibrate(0.5) == pytest.approx(0.5, abs=0.1)
    assert found.calibrate(0.99) == pytest.approx(0.9, abs=0.1)
    assert CalibrationMap().calibrate(1.0) == 0.9999


@pytest.mark.parametrize(
    ("more", "word"),
    [
        ({}, "identified"),
        ({"confirmed": None}, "ambiguous"),
        ({"alternatives": 1}, "ambiguous"),
        ({"unknown": 0.6}, "unknown"),
        ({"known_noise": False}, "ambiguous"),
        ({"causes": 0}, "none"),
        ({"causes": 0, "confirmed": False}, "ambiguous"),
    ],
)
def test_verdicts(more, word):
    own = {
        "unknown": 0.01, "best": 0.95, "alternatives": 0, "causes": 1, "known_noise": True, "confirmed": True,
    }  # fmt: skip
    assert decide(**{**own, **more}) == word


def test_a_family_keeps_to_the_bounds_of_columns_that_nuisances_hide():
    """The first column is nearly the constant of each group: 1 % of it is left, and the noise there is not its amplitude."""
    m = model(np.random.default_rng(10), (0.0, 0.1, 0.0, 0.1, 0.1))
    hidden = [replace(g, A=np.concatenate([1.0 + 0.01 * g.A[:, :, :1], g.A[:, :, 1:]], axis=2)) for g in m.groups]
    ends = SimpleNamespace(low=-0.1, high=0.1, scale=1.0, log=False, sign=0, coordinate=lambda v: v)
    bounds = AmplitudeBounds.of([ends] * 6, [False] * 6)
    bounded = LinearModel(groups=tuple(hidden), candidates=(), bounds=bounds, families={"wave": tuple(range(6))})
    found = explain(bounded, KnownNoise())
    assert found.background.families
    amount, covariance = found.amplitudes()
    assert np.abs(amount[0]) < 0.1 and covariance[0, 0] < 0.1**2
    assert amount[1:] == pytest.approx([0.1, 0.0, 0.1, 0.1, 0.0], abs=0.02)
