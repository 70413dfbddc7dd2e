"""What is too much for any input, so that arithmetic stays finite and an answer comes soon."""

LARGEST_NUMBER = 1e18  # in mm, N, rad, s and what is made of them; a rigid drive is written as 1e14 N/mm
SMALLEST_NUMBER = 1e-18  # of what is divided by


def number_of(text: str) -> float | None:
    """The number that a cell holds, NaN for `nan`; None for what is none, and for what is too large.

    Python takes more for a number than any control or spreadsheet writes: 1_0, infinity, digits of other scripts.
    """
    if "_" in text or not text.isascii():
        return None
    try:
        number = float(text)
    except ValueError:
        return None
    return None if abs(number) > LARGEST_NUMBER else number
