"""The measured rows of one run; NaN where a cell is empty or a column is missing."""

from dataclasses import dataclass

import numpy as np

from camcomp.ground.datatypes import Bools, Floats, Ints


@dataclass(frozen=True, eq=False, kw_only=True)
class Measured:
    """n rows, m actuators. tip (n, 3) mm program frame; setpoint, encoder, drive (n, m); load (n, m): second encoder
    behind the gear; dyno (n, 3) N machine frame; tip_sd (n, 3) mm: what the instrument states of its own deviation.
    """

    time: Floats
    line: Floats
    tip: Floats
    setpoint: Floats
    encoder: Floats
    drive: Floats
    load: Floats
    dyno: Floats
    temperature: Floats
    tip_sd: Floats

    def has(self, name: str) -> bool:
        """Whether the channel holds any value."""
        return bool(np.isfinite(getattr(self, name)).any())

    def force(self) -> Floats:
        """Force (n, 3) N that the dynamometer measured; empty cells lie between their neighbours in time, 0 without any."""
        out = np.zeros_like(self.dyno)
        for own, values in zip(out.T, self.dyno.T, strict=True):
            known = np.isfinite(values)
            if known.any():
                own[:] = np.interp(self.time, self.time[known], values[known])
        return out

    def take(self, rows: Bools | Ints) -> "Measured":
        """The rows that a mask picks."""
        return Measured(**{each: getattr(self, each)[rows] for each in self.__dataclass_fields__})


def channel_names(actuators: tuple[str, ...]) -> tuple[str, ...]:
    """Names of the residual channels in their order: tip, encoders, drive forces, dynamometer."""
    tips = ("tip_x", "tip_y", "tip_z")
    encoders = tuple(f"encoder_{a}" for a in actuators)
    drives = tuple(f"drive_{a}" for a in actuators)
    return (*tips, *encoders, *drives, "dyno_x", "dyno_y", "dyno_z")


def stack(tip: Floats, encoder: Floats, drive: Floats, dyno: Floats) -> Floats:
    """Channels (n, 6 + 2 m) in the order of channel_names."""
    return np.concatenate([tip, encoder, drive, dyno], axis=1)
