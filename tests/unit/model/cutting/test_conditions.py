from typing import Any

import numpy as np
import pytest

from camcomp.ground.errors import ConfigError
from camcomp.model.cutting.conditions import axial_depth, engagement, feed_per_tooth
from camcomp.model.cutting.cut import Cut


def cut(**changes: Any) -> Cut:
    """Two points of a level cut along x, the second on source line 12."""
    data: dict[str, Any] = {
        "tangent": [[1.0, 0.0, 0.0]] * 2, "tool_axis": [0.0, 0.0, 1.0], "feed": [300.0] * 2, "speed": [6000.0] * 2,
        "depth": [3.0] * 2, "width": [np.nan] * 2, "arc_length": [0.0, 1.0], "line": [11, 12],
        "diameter_mm": 25.0, "teeth": 2,
    }  # fmt: skip
    return Cut(**data | changes)


def test_feed_per_tooth_of_the_slot_experiment() -> None:
    np.testing.assert_allclose(feed_per_tooth(cut()), 0.025)


def test_only_the_level_part_of_a_ramp_feeds_the_chip() -> None:
    np.testing.assert_allclose(feed_per_tooth(cut(tangent=[[0.6, 0.0, -0.8]] * 2)), 0.6 * 0.025)


def test_above_the_stock_there_is_no_depth() -> None:
    np.testing.assert_array_equal(axial_depth(cut(depth=[-2.0, 0.5])), [0.0, 0.5])


@pytest.mark.parametrize(
    ("call", "changes", "rule", "key"),
    [
        (feed_per_tooth, {"speed": [6000, 0]}, "CC250", "spindle_rpm"),
        (feed_per_tooth, {"speed": [6000, np.nan]}, "CC250", "spindle_rpm"),
        (feed_per_tooth, {"teeth": None}, "CC251", "teeth"),
        (feed_per_tooth, {"teeth": 0}, "CC251", "teeth"),
        (feed_per_tooth, {"feed": [300, np.nan]}, "CC252", "feed_mm_per_min"),
        (axial_depth, {"depth": [1.0, np.nan]}, "CC253", "depth_mm"),
        (lambda c: engagement(c, "up"), {"width": [np.nan, 3.0], "diameter_mm": None}, "CC254", "diameter_mm"),
        (lambda c: engagement(c, "up"), {"width": [np.nan, 26.0]}, "CC255", "width_mm"),
        (lambda c: engagement(c, "up"), {"width": [np.nan, 0.0]}, "CC255", "width_mm"),
        (lambda c: engagement(c, None), {"width": [np.nan, 3.0]}, "CC256", "milling"),
    ],
)
def test_missing_data_are_refused_with_the_key_to_add(call: Any, changes: dict, rule: str, key: str) -> None:
    with pytest.raises(ConfigError) as caught:
        call(cut(**changes))
    assert caught.value.rule == rule
    assert key in (caught.value.hint or "")
    assert "teeth" in changes or "diameter_mm" in changes or "line 12" in caught.value.message


def test_a_slot_needs_neither_diameter_nor_side() -> None:
    start, stop = engagement(cut(diameter_mm=None), None)
    np.testing.assert_array_equal([start, stop], [[0, 0], [np.pi, np.pi]])
    start, stop = engagement(cut(width=[25.0, np.nan]), None)
    np.testing.assert_array_equal([start, stop], [[0, 0], [np.pi, np.pi]])


def test_a_cut_with_arrays_of_different_lengths_is_refused() -> None:
    with pytest.raises(ValueError, match="Cut.feed has shape"):
        cut(feed=[1.0])
