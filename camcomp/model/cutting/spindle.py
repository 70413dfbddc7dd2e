"""Check for lines that feed into material with a stopped spindle."""

import numpy as np

from camcomp.ground.datatypes import Ints
from camcomp.ground.source_lines import named_lines
from camcomp.ground.vectors import distinct, sizes
from camcomp.model.cutting.corners import NO_FORCE
from camcomp.model.cutting.track import Track


def cut_without_spindle(track: Track) -> Ints:
    """Source lines, ascending, along which the model cuts while the program has stopped the spindle."""
    still = np.flatnonzero(track.cutting & (track.path.turn[track.motion] == 0.0))
    force = track.force(still, np.full(len(still), 0.5))
    return np.array(distinct(track.path.line[track.motion[still[sizes(force) > NO_FORCE]]]), np.int64)


def spindle_warning(lines: Ints) -> list[str]:
    """Warning for source lines, ascending, that cut with a stopped spindle; empty without any."""
    return [f"the tool cuts with the spindle stopped (M5 or S0) at {named_lines(lines)}"] if len(lines) else []
