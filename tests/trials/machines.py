"""Machines under trial: kinematics of the perfect machine, and the loaded one with what is wrong in its structure.

A machine offers: `name`, `config` (the shipped file that describes it to camcomp), `actuators`, `origin` (of the program in the
machine frame, mm), `home` of its drives, `force` (right of the feed, along it, along the tool, N), `inverse`, `direct`,
`settle` and the stiffness of its drives.  All of it is typed in or solved here or in tests.plants; camcomp is not asked.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from tests.plants import energy, legs
from tests.trials.faults import Faults

ROOT = Path(__file__).resolve().parents[2]


class Orthoglide:
    """The reference Orthoglide with its tool of 100 mm."""

    name = "orthoglide"
    config = ROOT / "config" / "orthoglide.yaml"
    actuators = ("x", "y", "z")
    origin = np.array([-73.205, -73.205, -173.205])
    home = -300.0
    force = np.array([215.0, -10.0, -25.0])
    drive_N_per_mm = np.full(3, 1e4)
    _perfect = legs.orthoglide()

    def inverse(self, tip: np.ndarray) -> np.ndarray:
        """Actuators (n, 3) mm of the perfect machine for tips (n, 3) in the machine frame."""
        return energy.inverse(self._perfect, tip)

    def direct(self, joints: np.ndarray) -> np.ndarray:
        """Tips (n, 3) of the perfect machine, machine frame."""
        return energy.direct(self._perfect, joints) - [0.0, 0.0, self._perfect.tool]

    def structure(self, faults: Faults) -> legs.Legs:
        """The legs as they are."""
        built = legs.orthoglide(
            roll_deg=tuple(faults.sum("chain_error", "roll_deg", self.actuators)),
            longer=tuple(faults.sum("link_length", "length_mm", self.actuators)),
            drive_factor=tuple(faults.product("drive_stiffness", "factor", self.actuators)),
            link_factor=float(faults.product("link_stiffness", "factor", (None,))[0]),
        )
        return replace(built, tool=built.tool + float(faults.sum("tool_length", "length_mm", (None,))[0]))

    def settle(self, faults: Faults, joints: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Loaded tips (n, 3) mm, machine frame, and drive forces (n, 3) N at joints (n, 3) under forces (n, 3)."""
        weight = float(faults.sum("gravity", "weight_N", (None,))[0])
        found = energy.settle(self.structure(faults), joints, force, weight=weight)
        return found.tip, found.drive


MACHINES = {"orthoglide": Orthoglide()}
