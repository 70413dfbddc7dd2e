"""Numbers of a program: read strictly, written in plain decimal notation."""

import math

FEED_DIGITS = 6  # significant digits of a feed


def decimals(resolution_mm: float, unit_mm: float) -> int:
    """Digits after the point so that one step of the last digit is not coarser than `resolution_mm`."""
    return max(0, math.ceil(-math.log10(resolution_mm / unit_mm) - 1e-9))


def plain(value: float, digits: int, point: bool = True) -> str:
    """`value` rounded to `digits` decimals: no exponent, no minus zero, no useless zeros.

    With `point`, a whole number keeps `.0`, because some controllers read a number without a point in micrometres.
    """
    text = f"{value:.{digits}f}"
    if digits:
        text = text.rstrip("0")
        if text.endswith("."):
            text = text + "0" if point else text[:-1]
    elif point:
        text += ".0"
    return text[1:] if text.startswith("-") and float(text) == 0.0 else text


def significant(value: float, digits: int = FEED_DIGITS, point: bool = False) -> str:
    """A feed with `digits` significant digits; whole numbers get a decimal point only with `point`."""
    if value <= 0.0:
        return "0"
    return plain(value, max(0, digits - 1 - math.floor(math.log10(value))), point)
