import numpy as np

from camcomp.model.cutting.engagement import immersion


def test_up_milling_begins_square_to_the_feed_and_down_milling_ends_there() -> None:
    widths = [0.0, 2.5, 5.0, 10.0, np.nan]
    arc = [0.0, np.pi / 3, np.pi / 2, np.pi, np.pi]
    start, stop = immersion(widths, 10.0, "up")
    np.testing.assert_allclose(start, 0.0)
    np.testing.assert_allclose(stop, arc)
    start, stop = immersion(widths, 10.0, "down")
    np.testing.assert_allclose(start, np.pi - np.array(arc))
    np.testing.assert_allclose(stop, np.pi)
