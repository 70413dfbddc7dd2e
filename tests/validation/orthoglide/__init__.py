"""Experiments on the reference Orthoglide: every cause, causes withheld from the library, equivalent pairs, poor channels."""
