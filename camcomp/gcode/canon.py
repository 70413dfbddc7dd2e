"""The path of a program as text, one line per motion, independent of dialect and modes."""

from collections.abc import Iterator

import numpy as np

from camcomp.gcode.numbers import plain
from camcomp.ground.datatypes import ARC, LINE, RAPID, Path
from camcomp.ground.orientation import LETTERS

_KINDS = {RAPID: "rapid", LINE: "line", ARC: "arc"}


def canonical(path: Path, digits: int = 4) -> Iterator[str]:
    """Source line, kind, end point in mm in the program frame; for arcs centre, axis and sweep; feed of cutting moves.

    `machine` marks moves in machine coordinates, `start unknown` those before X, Y and Z have all been commanded.
    """
    for k in range(len(path)):
        kind = int(path.kind[k])
        words = [f"{path.line[k]:6d}", f"{_KINDS[kind]:5s}", _point("XYZ", path.end[k], digits)]
        if kind == ARC:
            axis = "XYZ"[int(np.argmax(path.axis[k]))] if path.axis[k].max() == 1.0 else _point("XYZ", path.axis[k], 6)
            angle = plain(float(np.degrees(path.angle[k])), digits, point=False)
            words += ["centre", _point("XYZ", path.centre[k], digits), f"about {axis} by {angle} deg"]
        if path.orientation is not None:
            turn = path.orientation
            signs = [letter + "=" * (len(letter) > 1) for letter in LETTERS[turn.form]]
            words += [s + plain(float(each), digits + 2) for s, each in zip(signs, turn.end[k], strict=True)]
        if kind != RAPID:
            words += [f"F{plain(float(path.feed[k]), digits, point=False)}"]
        words += [f"S{plain(float(path.speed[k]), digits, point=False)}", f"T{path.tool[k]}"]
        words += ["machine"] * bool(path.machine[k]) + ["start unknown"] * (not path.known[k])
        yield " ".join(words)


def _point(letters: str, point: np.ndarray, digits: int) -> str:
    return " ".join(f"{letter}{plain(float(each), digits)}" for letter, each in zip(letters, point, strict=True))
