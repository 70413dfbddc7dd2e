"""Names of the columns of a log, for writing and for reading."""

from __future__ import annotations

from collections.abc import Sequence

from camcomp.ground.records import dataclass

TIME, LINE, TEMPERATURE = "t_s", "line", "temp_C"
TIP = ("x_mm", "y_mm", "z_mm")
TIP_SD = ("x_sd_mm", "y_sd_mm", "z_sd_mm")
DYNO = ("fx_N", "fy_N", "fz_N")


@dataclass(frozen=True)
class LogColumns:
    """Names per actuator (m): set-points, encoders, drive forces, second encoders behind the gear."""

    setpoint: tuple[str, ...]
    encoder: tuple[str, ...]
    drive: tuple[str, ...]
    load: tuple[str, ...]

    @property
    def simulated(self) -> tuple[str, ...]:
        """Columns of a simulated log in order: all quantities that the model computes."""
        return (TIME, LINE, *TIP, *self.setpoint, *self.encoder, *self.drive, *DYNO)

    @property
    def known(self) -> tuple[str, ...]:
        """All columns that a log may have."""
        return (*self.simulated, *self.load, TEMPERATURE, *TIP_SD)


def log_columns(actuators: Sequence[str], rotary: Sequence[bool]) -> LogColumns:
    """Column names for actuators by name, in their order; rotary: whether each is a hinge."""
    lengths = ["rad" if each else "mm" for each in rotary]
    efforts = ["Nmm" if each else "N" for each in rotary]
    return LogColumns(
        tuple(f"cmd_{a}_{unit}" for a, unit in zip(actuators, lengths, strict=True)),
        tuple(f"act_{a}_{unit}" for a, unit in zip(actuators, lengths, strict=True)),
        tuple(f"act_{a}_{unit}" for a, unit in zip(actuators, efforts, strict=True)),
        tuple(f"load_{a}_{unit}" for a, unit in zip(actuators, lengths, strict=True)),
    )
