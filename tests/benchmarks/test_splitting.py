"""How many lines the sample grooves take, against the fewest that the tolerance allows."""

import pytest

from tests.fewest import groove

pytestmark = pytest.mark.benchmarks


def test_lines_of_the_sample_grooves(capsys):
    told = ["groove  tolerance  lines  fewest by search  by bound  ratio"]
    for name in (50, 2):
        for tolerance_um in (0.5, 1.0, 2.0, 5.0, 10.0):
            lines, search, bound = groove(name, tolerance_um=tolerance_um)
            ratio = lines / min(search, bound)
            told.append(f"{name:6d}  {tolerance_um:6.1f} um  {lines:5d}  {search:16d}  {bound:8d}  {ratio:5.3f}")
            assert ratio <= 1.2
    with capsys.disabled():
        print("\n" + "\n".join(told))
