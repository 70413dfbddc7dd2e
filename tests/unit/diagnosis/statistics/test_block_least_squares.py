"""What a block that is left out may still know of itself."""

import numpy as np

from camcomp.diagnosis.axis.block_least_squares import gain, series, withheld


def test_what_lasts_across_the_border_of_two_blocks_does_not_foretell_itself():
    time = np.arange(0.0, 10.0, 0.01)
    border = 10.0 / 25 * 12
    for half_width, foretold in ((0.15, False), (1.0, True)):
        bump = (np.abs(time - border) < half_width).astype(float)
        data = series([time], [bump + 0.01 * np.random.default_rng(1).standard_normal(len(time))])
        found = gain(withheld(data, np.zeros((len(time), 0))), withheld(data, bump[:, None]))
        assert (found.log_ratio > 0.1) == foretold
