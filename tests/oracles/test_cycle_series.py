"""Series of canned cycles of several kinds, with G98 and G99 in turns: where LinuxCNC approaches and retracts."""

import random

import pytest

from camcomp.gcode.interpret import read_program
from camcomp.gcode.setup import Setup
from tests.oracles import rs274
from tests.oracles.compare import difference

PLANES = {"G17": "XYZ", "G18": "ZXY", "G19": "YZX"}
WORDS = {"G73": " Q2", "G81": "", "G82": " P0.2", "G83": " Q2", "G85": "", "G86": " P0.1", "G89": " P0.2"}


def series(seed):
    """A program of some cycles; the retract planes lie above all bottoms, below and above where the series began."""
    rng = random.Random(seed)
    plane, (u, v, depth) = rng.choice([*PLANES.items(), ("G17", PLANES["G17"])])
    distance = rng.choice(["G90", "G90", "G91"])
    lines = [
        f"G21 G90 {plane} G94 G61",
        "S800 M3",
        f"G0 X0 Y0 Z0 {depth}{rng.choice([1, 3, 6])}".replace(f" {depth}0", ""),
    ]
    lines.append(distance)
    cycle = None
    for _ in range(rng.randint(3, 8)):
        word = rng.choice([*WORDS, "", "", "G0", "G80"])
        if word == "G80":
            lines.append("G80")
        elif word == "G0":
            lines.append(f"G0 {u}{rng.randint(-5, 5)} {depth}{rng.choice([1, 4, 9])}")
        elif word or cycle:
            line = f"{rng.choice(['G98 ', 'G99 ', ''])}{word} {u}{rng.randint(-9, 9)} {v}{rng.randint(-9, 9)}"
            if word and word != cycle:
                line += f" {depth}-{rng.randint(2, 4)} R{rng.choice([0, 1, 2, 5, 8])} F600{WORDS[word]}"
            elif rng.random() < 0.3:
                line += f" R{rng.choice([0, 1, 2, 5])}"
            lines.append(line + (" L2" if rng.random() < 0.1 else ""))
        cycle = None if word in ("G0", "G80") else word or cycle
    return "\n".join([*lines, "G80", "M2", ""])


@rs274.needs_rs274
@pytest.mark.parametrize("seed", range(60))
def test_approaches_and_retracts_are_those_of_linuxcnc(seed):
    text = series(seed)
    run = rs274.run(text)
    assert not run.error, text
    assert difference(read_program(text.encode(), name="p.nc", setup=Setup(start_mm=(0.0, 0.0, 0.0))), run) == "", text


@rs274.needs_rs274
def test_a_program_may_begin_with_a_cycle():
    text = "G21 F100\nG81 X1 Y1 Z-1 R1\nG98 G81 X3 Z-2 R2\nM2\n"
    run = rs274.run(text)
    assert not run.error
    assert difference(read_program(text.encode(), name="p.nc", setup=Setup(start_mm=(0.0, 0.0, 0.0))), run) == ""
