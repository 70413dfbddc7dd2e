"""Long programs for measuring: a pocketed groove of short straight moves."""

import math
from collections.abc import Callable, Iterator

HEADER = (
    "%",
    "(pocketed groove between two circles, in short straight moves)",
    "N10 G21 G90 G17 G94",
    "N20 T1 M6",
    "N30 S8000 M3",
    "N40 G0 X22 Y0 Z5",
    "(cut in layers, every layer in circles from the inside to the outside)",
    "N50 G1 Z0 F300",
    "N60 M8",
    "G1 F1200",
)
INNER, OUTER, STEP_OVER, STEP_DOWN = 22.0, 28.0, 1.0, 0.5  # mm
CHORD = 0.12  # mm, length of a move


def groove(moves: int) -> Iterator[str]:
    """Lines of the program: ten of header, `moves` short G1 moves with X, Y, Z of four decimals, a few of retreat."""
    yield from HEADER
    made, depth = 0, 0.0
    while made < moves:
        radius = INNER
        depth -= STEP_DOWN
        if depth < -10.0:
            depth = -STEP_DOWN
        while radius <= OUTER + 1e-9 and made < moves:
            count = math.ceil(2.0 * math.pi * radius / CHORD)
            for k in range(count + 1):
                if made == moves:
                    break
                a = 2.0 * math.pi * k / count
                r = radius + STEP_OVER * k / count  # a spiral: the circles join without a corner
                z = depth + (STEP_DOWN * (1.0 - k / 200.0) if radius == INNER and k < 200 else 0.0)
                yield f"G1 X{r * math.cos(a):.4f} Y{r * math.sin(a):.4f} Z{z:.4f}"
                made += 1
            radius += STEP_OVER
    yield "G0 Z5"
    yield "M5 M9"
    yield "M30"
    yield "%"


def stitches(moves: int) -> Iterator[str]:
    """Lines of a program of cuts of 1 mm along a circle, with a rapid between any two."""
    yield from HEADER
    for k in range(moves // 2):
        a = 0.01 * k
        yield f"G0 X{20.0 * math.cos(a):.4f} Y{20.0 * math.sin(a):.4f}"
        yield f"G1 X{20.0 * math.cos(a + 0.05):.4f} Y{21.0 * math.sin(a + 0.05):.4f}"
    yield from ("G0 Z5", "M5 M9", "M30", "%")


def write(path: str, moves: int, lines: Callable[[int], Iterator[str]] = groove) -> None:
    """Writes a program to a file."""
    with open(path, "w", encoding="ascii") as file:
        file.writelines(f"{line}\n" for line in lines(moves))
