"""A smooth, bounded map over one or two covariates, found by diagnose where no short formula fits."""

from camcomp.effects._law import on_drive, on_place, on_servo
from camcomp.model.law.spec import MapSpec as Params

__all__ = ["Params", "on_drive", "on_place", "on_servo"]
STAGE = "structure"
TARGET = "either"
PARAMETERS = ()
SOURCE = "the data of the experiment in which it was found"
