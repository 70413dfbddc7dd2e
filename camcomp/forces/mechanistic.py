"""Linear-edge mechanistic milling forces, averaged over a revolution."""

from typing import Literal

import numpy as np
from pydantic import Field

from camcomp.ground.datatypes import Floats
from camcomp.model.config.base import Spec
from camcomp.model.cutting.average import linear_edge, slanted, summed, to_path
from camcomp.model.cutting.conditions import clockwise, engagement_arcs, feed_per_tooth
from camcomp.model.cutting.cut import Cut

SOURCES = (
    "Y. Altintas, Manufacturing Automation, section 2.7: edge forces linear in the chip thickness, integrated over the "
    "engagement. Means from coefficients of the same material agree with measurements to 10-30 %; peaks of a tooth are "
    "2 to 4 times the mean."
)

STEADY = True  # the force depends on the cut alone, not on the way to it


class Params(Spec):
    """Cutting coefficients (force per chip area) and edge coefficients (force per length of edge)."""

    Ktc_N_per_mm2: float = Field(gt=0, description="tangential cutting coefficient")
    Krc_N_per_mm2: float = Field(description="radial cutting coefficient, positive towards the tool centre")
    Kac_N_per_mm2: float = Field(description="axial cutting coefficient; positive pulls the tool towards the work")
    Kte_N_per_mm: float = Field(description="tangential edge coefficient")
    Kre_N_per_mm: float = Field(description="radial edge coefficient, positive towards the tool centre")
    Kae_N_per_mm: float = Field(description="axial edge coefficient; positive pulls the tool towards the work")
    milling: Literal["up", "down"] | None = Field(None, description="side that cuts; needed when the cut is no slot")
    spindle: Literal["clockwise", "counterclockwise"] | None = Field(
        None, description="sense of rotation, seen from above the tool; M3 and M4 of the program say it, too"
    )


def force(cut: Cut, params: Params) -> Floats:
    """(Fr, Ft, Fz) (n, 3) in N. Raises ConfigError CC250 to CC256 when the Cut lacks data."""
    chip, sense = feed_per_tooth(cut), clockwise(cut, params.spindle)
    arcs = engagement_arcs(cut, params.milling, sense)
    rise, run = arcs.rise, arcs.run
    cutting = np.stack(
        [params.Ktc_N_per_mm2 * np.ones_like(rise), *slanted(params.Krc_N_per_mm2, params.Kac_N_per_mm2, rise, run)]
    )
    # A slanted edge is longer than the height on which it cuts.
    edge = np.stack(
        [params.Kte_N_per_mm * np.ones_like(rise), *slanted(params.Kre_N_per_mm, params.Kae_N_per_mm, rise, run)]
    )
    mean = linear_edge(
        chip=chip[arcs.place],
        depth=arcs.height,
        teeth=cut.teeth or 0,
        start=arcs.start,
        stop=arcs.stop,
        cutting=cutting,
        edge=edge / rise,
    )
    return to_path(summed(mean, arcs.place, len(cut)), sense)
