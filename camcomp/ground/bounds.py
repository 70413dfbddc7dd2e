"""Limits of the size of any input, which keep arithmetic finite and run times short."""

LARGEST_NUMBER = 1e18  # in mm, N, rad, s and their products; a rigid drive is written as 1e14 N/mm
SMALLEST_NUMBER = 1e-18  # of a divisor


def number_of(text: str) -> float | None:
    """Number in a cell, NaN for `nan`; None for other texts and numbers beyond LARGEST_NUMBER.

    Stricter than Python's float(), which also accepts 1_0, infinity and digits of other scripts.
    """
    if "_" in text or not text.isascii():
        return None
    try:
        number = float(text)
    except ValueError:
        return None
    return None if abs(number) > LARGEST_NUMBER else number
