"""A law in words of arithmetic, found by diagnose or known otherwise, with the envelope in which it was seen."""

from camcomp.effects._law import on_drive, on_place, on_servo
from camcomp.model.law.spec import FormulaSpec as Params

__all__ = ["Params", "on_drive", "on_place", "on_servo"]
STAGE = "structure"
TARGET = "either"
PARAMETERS = ()
SOURCE = "the data of the experiment in which it was found"
