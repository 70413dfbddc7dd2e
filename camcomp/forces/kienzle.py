"""Kienzle's power law of the chip thickness, averaged over a revolution of a milling cutter."""

from typing import Literal

import numpy as np
from pydantic import Field

from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError
from camcomp.model.config.base import Spec
from camcomp.model.cutting.average import power_law, slanted, summed, to_path
from camcomp.model.cutting.conditions import clockwise, engagement_arcs, feed_per_tooth
from camcomp.model.cutting.cut import Cut

SOURCES = (
    "Kienzle's law kc = kc1.1 h^-mc (h in mm), integrated exactly over the engagement. kc falls by about 1 % per degree "
    "of rake (material note in FreeCAD; Sandvik: tables hold for neutral inserts). Predicted for aluminium, measured "
    "slots come out 6 to 31 % too high, depending on the table."
)

RAKE_LOSS_PER_DEG = 0.01

STEADY = True  # the force depends on the cut alone, not on the way to it


class Params(Spec):
    """Specific cutting force of the material, and ratios of the force components."""

    kc11_N_per_mm2: float = Field(gt=0, description="specific cutting force at a chip of 1 mm x 1 mm")
    mc: float = Field(ge=0, lt=1, description="exponent of the chip thickness")
    radial_ratio: float | None = Field(None, description="radial over tangential force; to be measured")
    axial_ratio: float | None = Field(None, description="axial over tangential force; positive pulls the tool down")
    rake_deg: float = Field(0.0, gt=-90, lt=90, description="rake of the tool; tables of kc1.1 hold for 0")
    milling: Literal["up", "down"] | None = Field(None, description="side that cuts; needed when the cut is no slot")
    spindle: Literal["clockwise", "counterclockwise"] | None = Field(
        None, description="sense of rotation, seen from above the tool; M3 and M4 of the program say it, too"
    )


def force(cut: Cut, params: Params) -> Floats:
    """(Fr, Ft, Fz) (n, 3) in N. Raises ConfigError CC250 to CC257 when data are missing."""
    if params.radial_ratio is None or params.axial_ratio is None:
        missing = "radial_ratio" if params.radial_ratio is None else "axial_ratio"
        raise ConfigError("CC257", f"Kienzle's law needs the key process: force: {missing}")
    kc11 = params.kc11_N_per_mm2 * (1 - RAKE_LOSS_PER_DEG * params.rake_deg)
    chip, sense = feed_per_tooth(cut), clockwise(cut, params.spindle)
    arcs = engagement_arcs(cut, params.milling, sense)
    ratios = np.stack(slanted(params.radial_ratio, params.axial_ratio, arcs.rise, arcs.run))
    # On a slanted edge the chip is thinner by `rise`, and longer.
    thin = kc11 * arcs.rise**-params.mc
    mean = power_law(
        chip=chip[arcs.place],
        depth=arcs.height,
        teeth=cut.teeth or 0,
        start=arcs.start,
        stop=arcs.stop,
        kc11=thin,
        mc=params.mc,
        ratios=ratios,
    )
    return to_path(summed(mean, arcs.place, len(cut)), sense)
