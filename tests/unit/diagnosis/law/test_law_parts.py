"""The parts of a law search: forms that can be read, evidence in closed form, a library that gives back what it was given."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from camcomp.diagnosis.law.bench_terms import Spot, Term
from camcomp.diagnosis.law.find import simplest, unlikely
from camcomp.diagnosis.law.forms import Sizes, at_drive, at_tip
from camcomp.diagnosis.law.library import LearnedLaw, keep, learned
from camcomp.diagnosis.result.types import Law, LawPart, LawTerm
from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.diagnosis.statistics.folds import ALTERNATING, Folds, Split, _grams, gains, usual_split, withheld
from camcomp.model.law.covariates import AT_DRIVE, AT_TIP, is_load
from camcomp.model.law.expression import parse
from camcomp.model.law.spline_map import splines, tensor


def sizes(names):
    limits = {name: (-20.0, 30.0) for name in names} | {"common_s": (0.0, 130.0), "cut_min": (0.0, 3.0)}
    return Sizes(limits, dict.fromkeys(names, 1.0), ((0.0, 20.0), (100.0, 130.0)))


@pytest.mark.parametrize(
    ("forms", "names"), [(at_tip(sizes(AT_TIP)), AT_TIP), (at_drive(sizes(AT_DRIVE), False), AT_DRIVE)]
)
def test_every_form_is_a_formula_over_what_is_known_there(forms, names):
    assert len({each.said for each in forms}) > 0.9 * len(forms) > 300
    for each in forms:
        assert len(each.texts) == len(each.units) and len(each.shape) == len(each.bounds)
        for text in each.said:
            assert set(parse(text, names).names) <= set(names)
        assert all(low <= value <= high for value, (low, high) in zip(each.shape, each.bounds, strict=True)), each


def test_the_gain_is_that_of_the_marginal_density():
    rng = np.random.default_rng(1)
    X, r, size = rng.normal(size=(12, 2)), rng.normal(size=12), np.array([0.5, 2.0])
    with_law = multivariate_normal(np.zeros(12), np.eye(12) + X @ np.diag(1 / size) @ X.T).logpdf(r)
    without = multivariate_normal(np.zeros(12), np.eye(12)).logpdf(r)
    got = gains((X.T @ X)[None], (X.T @ r)[None], size)
    assert got[0] == pytest.approx(with_law - without)


def test_what_is_withheld_is_judged_by_what_the_others_say():
    assert withheld(np.array([10.0, 6.0, 7.0])) == pytest.approx((10.0 - 6.0) + (10.0 - 7.0))


def test_few_runs_are_withheld_in_stretches_and_what_lasts_a_while_in_every_other_one():
    assert usual_split(5) == Split(1, 1) and usual_split(2) == Split(2, 2)
    assert Split(3, 3).of(np.array([0.0, 0.4, 0.7, 1.0])).tolist() == [0, 1, 2, 2]
    place = (np.arange(ALTERNATING.stretches) + 0.5) / ALTERNATING.stretches
    assert ALTERNATING.of(place).tolist() == [0, 1] * (ALTERNATING.stretches // 2)


def test_what_stands_beside_a_law_gives_way_to_it():
    rng = np.random.default_rng(2)
    known, law = rng.normal(size=(400, 1)), rng.normal(size=(400, 1))
    known = known + 2.0 * law  # looks like the law, where nothing else may
    residual = 3.0 * law[:, 0] + 0.1 * rng.normal(size=400)
    folds = Folds([ByChannel.of([known])], [residual], np.array([1e-4]), [np.linspace(0.0, 1.0, 400)], Split(2, 2), [])
    alone = float(known[:, 0] @ residual / (known[:, 0] @ known[:, 0]))
    beside = folds.means([[ByChannel.of([law])]], np.array([1e-4]))
    assert alone > 1.0 and beside.shape == (3, 1) and np.abs(beside).max() < 0.02


def test_what_is_withheld_has_no_say():
    rng = np.random.default_rng(3)
    known, law = rng.normal(size=(400, 1)), rng.normal(size=(400, 1))
    residual = 2.0 * known[:, 0] + 3.0 * law[:, 0]
    residual[:200] *= -1.0
    folds = Folds([ByChannel.of([known])], [residual], np.array([1e-4]), [np.linspace(0.0, 1.0, 400)], Split(2, 2), [])
    columns, prior = [[ByChannel.of([law])]], np.array([1e-4])
    assert folds.means(columns, prior)[1:, 0] == pytest.approx([2.0, -2.0], abs=1e-3)
    each, covariance = folds.coefficients(columns, prior)
    assert each[1:, 0] == pytest.approx([3.0, -3.0], abs=1e-3)
    assert covariance[0, 0] == pytest.approx(1.0 / 400, rel=0.3)


def test_creep_under_load_is_a_form():
    (form,) = [f for f in at_tip(sizes(AT_TIP)) if f.family == "settling" and len(f.about) == 2][:1]
    assert form.about == ("cut_min", "force_N") and form.units == ("", "N") and form.said[1].endswith("*force_N")


def test_what_goes_evenly_with_a_drives_own_load_is_its_stiffness_and_no_form():
    size = sizes((*AT_DRIVE, "load_N", "load_y_N"))
    said = {(each.about, each.said): each.units for each in at_drive(size, False) if is_load(each.about[0])}
    own, other = (
        {said_[1][0]: unit for said_, unit in said.items() if said_[0] == (name,)} for name in ("load_N", "load_y_N")
    )
    assert own == {"load_N*abs(load_N)": ("N2",), "load_N^2": ("N2",), "load_N^3": ("N3",)}
    assert other["load_y_N"] == ("N",) and len(other) == 4
    still = {name: (0.0, 0.0) for name in ("load_N", "load_y_N")}
    idle = at_drive(Sizes(size.limits | still, size.apart, size.stretches), False)
    assert not any(is_load(each.about[0]) for each in idle)


def test_of_a_force_at_the_tip_and_the_load_of_a_drive_that_is_the_same_the_tip_goes_before():
    force = next(f for f in at_tip(sizes(AT_TIP)) if f.about == ("fy_N",))
    load = next(f for f in at_drive(sizes((*AT_DRIVE, "load_y_N")), False) if f.about == ("load_y_N",))
    assert unlikely(Term(Spot("drive", 0), load)) and not unlikely(Term(Spot("structure", 0), force))


def test_of_sets_that_explain_alike_the_one_of_fewer_and_simpler_terms_goes_before():
    forms, spot = at_tip(sizes(AT_TIP)), Spot("structure", 0)
    terms = [Term(spot, next(f for f in forms if f.family == family)) for family in ("wave", "power", "line")]
    assert simplest({(): 0.0, (0,): 12.0, (1,): 10.0}, terms) == (1,)  # else a parabola is a piece of a long wave
    assert simplest({(): 0.0, (0,): 12.0, (1, 2): 14.0}, terms) == (0,)
    assert simplest({(): 0.0, (0,): 12.0, (1, 2): 16.0}, terms) == (1, 2)
    assert simplest({(): 0.0, (0,): 2.0}, terms) == ()


def test_splines_add_up_to_one_and_stay_within_their_limits():
    basis = splines(np.linspace(-3.0, 13.0, 50), 0.0, 10.0, 7)
    assert basis.sum(axis=1) == pytest.approx(1.0) and basis.min() >= 0.0
    assert tensor([basis, basis]).sum(axis=1) == pytest.approx(1.0)


def law_of(*terms):
    part = LawPart(
        effect="formula",
        stage="drive",
        target="y",
        axis=None,
        envelope={"act_mm": (0.0, 9.0)},
        formula="2*act_mm - 0.5*act_mm^2",
    )
    told = tuple(LawTerm(term=f"drive y: {text}", value=value, ci95=(value, value), unit="mm") for text, value in terms)
    return Law(formula="drive y = ...", on="drive", terms=told, envelope={}, after_rms_um=1.0, parts=(part,))


def test_a_library_gives_back_terms_that_have_their_own_size(tmp_path):
    folder = str(tmp_path / "laws")
    assert learned(folder) == []
    name = keep(folder, law_of(("act_mm", 2.0), ("act_mm^2", -0.5), ("1", 0.3)), "lathe")
    assert keep(folder, law_of(("act_mm", 2.0), ("act_mm^2", -0.5), ("1", 0.3)), "lathe") == name
    (found,) = learned(folder)
    assert (found.name, found.machine) == (name, "lathe")
    assert [p.name for p in found.parameters] == ["factor_1", "factor_2"]  # what is constant is no law
    entries = found.entries({"factor_1": 0.5, "factor_2": 2.0})
    assert [each["formula"] for each in entries] == ["1*act_mm", "-1*act_mm^2"]
    assert entries[0]["target"] == "y" and entries[0]["stage"] == "drive"
    assert found.candidate(("x", "z")) is None
    cause = found.candidate(("x", "y"))
    assert cause.name == name and hasattr(cause.effect, "on_drive") and not hasattr(cause.effect, "on_place")


def test_a_law_over_a_drives_load_waits_for_a_machine_that_has_the_drive():
    found = LearnedLaw("found", "lathe", law_of(("load_x_N", 1e-4)))
    assert found.candidate(("y", "z")) is None and found.candidate(("x", "y")) is not None


def test_a_run_in_which_a_channel_has_no_row_adds_nothing_to_its_products():
    some = np.random.default_rng(6).standard_normal((5, 4))
    assert _grams([some, np.zeros((0, 4))], 2) == pytest.approx(_grams([some], 2))
