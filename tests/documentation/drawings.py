"""The drawings of docs/explanation, one per idea: `python -m tests.documentation.drawings` writes them anew.

Paths under load are those that `compensate --paths` gives for the samples; the others are drawn from their formulas.
"""

import math

import numpy as np

import camcomp
from tests.commandline import ROOT
from tests.documentation.svg import BLUE, GREY, INK, RED, Drawing

FOLDER = ROOT / "docs/pictures"


def correction():
    """Circle of 1 mm near a corner of the Orthoglide's cube: programmed, loaded, corrected path."""
    machine = camcomp.load_machine(ROOT / "config/orthoglide-1deg.yaml")
    paths = camcomp.compensate(ROOT / "samples/groove-circle-2.nc", machine).paths
    on_circle = np.abs(np.hypot(paths["target_x_mm"], paths["target_y_mm"]) - 1.0) < 1e-3
    cut = np.flatnonzero(on_circle & (paths["line"] == paths["line"][on_circle][len(paths["line"][on_circle]) // 2]))[
        1:
    ]
    sheet = Drawing((-2.6, -2.4, 2.6, 2.2))
    for name, color, text, place in (
        ("target", INK, "programmed = loaded tip after correction", (-2.5, -1.4)),
        ("chain_error", GREY, "without load, legs rolled by 1°", (-2.5, -1.65)),
        ("both", RED, "loaded tip, original program", (-2.5, -1.9)),
        ("adjusted", BLUE, "corrected program", (-2.5, -2.15)),
    ):
        x, y = paths[f"{name}_x_mm"][cut], paths[f"{name}_y_mm"][cut]
        sheet.path(
            list(zip(x, y, strict=True)),
            color,
            2.2 if name == "target" else 1.6,
            "5 4" if name == "chain_error" else "",
        )
        sheet.word(place, text, color, size=13)
    return sheet


def equilibrium():
    """Deflection: the commanded pose, the spring between it and the loaded tip, and the shifted command."""
    sheet = Drawing((0, 0, 10, 3.4))
    for y, command, loaded, text in (
        (2.3, 4.0, 6.2, "original program: command = target"),
        (0.8, 1.8, 4.0, "corrected program: loaded tip = target"),
    ):
        spring = [
            (command + (loaded - command) * k / 12, y + (0.14 * (-1) ** k if 1 < k < 11 else 0.0)) for k in range(13)
        ]
        sheet.path(spring, GREY)
        sheet.dot((command, y), BLUE, 5)
        sheet.dot((loaded, y), RED, 5)
        sheet.arrow((loaded + 0.15, y), (loaded + 1.4, y), RED)
        sheet.word((loaded + 1.5, y - 0.08), "F", RED)
        sheet.word((command, y - 0.42), "command", BLUE, "middle", 12)
        sheet.word((loaded, y - 0.42), "loaded tip", RED, "middle", 12)
        sheet.word((0.2, y + 0.55), text, INK, "start", 12)
    sheet.path([(4.0, 0.2), (4.0, 3.2)], INK, 1.0, "3 4")
    sheet.word((4.08, 3.1), "target t₀", INK, size=12)
    return sheet


def assembly():
    """Three springs of different stiffness whose free ends miss each other meet where their forces balance (eq. 7)."""
    sheet = Drawing((-4.2, -4.4, 4.2, 2.9))
    ends, stiffness = np.array([[0.9, 0.2], [-0.7, 0.6], [0.1, -0.9]]), np.array([3.0, 1.0, 1.0])
    meeting = stiffness @ ends / stiffness.sum()
    for k, angle in enumerate((20, 140, 265)):
        foot = 3.0 * np.array([math.cos(math.radians(angle)), math.sin(math.radians(angle))])
        sheet.path([foot, ends[k]], GREY, 1.0 + 0.8 * stiffness[k])
        sheet.dot(ends[k], BLUE)
        sheet.arrow(ends[k], meeting, RED, 1.3)
        sheet.word(foot * 1.08, f"chain {k + 1}", INK, "middle", 12)
    sheet.dot(meeting, RED, 5)
    sheet.dot((0, 0), INK, 4)
    sheet.word((-4.0, -3.6), "nominal end", INK, size=12)
    sheet.word((-4.0, -3.9), "end of each chain by itself, ε", BLUE, size=12)
    sheet.word((-4.0, -4.2), "end of the assembled machine, δt: forces balance", RED, size=12)
    return sheet


def frames():
    """Path frame on a counter-clockwise groove: t along the feed, r to its right, z out of the sheet."""
    sheet = Drawing((-3.6, -2.6, 4.4, 2.8))
    sheet.path([(2 * math.cos(a), 2 * math.sin(a)) for a in np.linspace(0, 2 * math.pi, 90)], GREY, 10)
    at = np.array([2 * math.cos(0.6), 2 * math.sin(0.6)])
    radial, along = at / 2, np.array([-at[1], at[0]]) / 2
    sheet.arrow(at, at + 1.5 * along, BLUE)
    sheet.arrow(at, at + 1.5 * radial, RED)
    sheet.dot(at, INK, 5)
    sheet.word(at + 1.6 * along, "t: feed", BLUE, "end")
    sheet.word(at + 1.55 * radial, "r = t × z", RED)
    sheet.word(at + np.array([0.12, -0.35]), "z: towards you", INK)
    sheet.arrow((0, 0), (0.9, 0), INK)
    sheet.arrow((0, 0), (0, 0.9), INK)
    sheet.word((0.95, -0.1), "X", INK)
    sheet.word((0.1, 0.95), "Y", INK)
    sheet.word((-3.4, -2.4), "program frame (G54); cut counter-clockwise, r points outwards", INK, size=12)
    return sheet


def joining():
    """Where the force starts, the correction jumps: a joining line from the uncorrected to the corrected path."""
    sheet = Drawing((0, 0, 10, 3.2))
    sheet.path([(0.5, 1.0), (9.5, 1.0)], INK, 1.2, "4 4")
    sheet.path([(0.5, 1.0), (4.0, 1.0), (4.0, 2.2), (9.5, 2.2)], BLUE, 2.2)
    sheet.dot((4.0, 1.0), BLUE)
    sheet.dot((4.0, 2.2), BLUE)
    for x in (5.0, 6.5, 8.0):
        sheet.arrow((x, 2.0), (x, 1.1), RED, 1.3)
    sheet.word((8.2, 1.5), "deflection under F", RED, size=12)
    sheet.word((0.6, 0.6), "air: no force", INK, size=12)
    sheet.word((6.3, 0.6), "programmed = loaded path of the cut", INK, size=12)
    sheet.word((2.0, 1.6), "joining line", BLUE, size=12)
    sheet.word((5.6, 2.45), "corrected path", BLUE, size=12)
    return sheet


def chords():
    """Chords of an arc whose inner vertices are moved out share the miss: half outside, half inside."""
    sheet = Drawing((-4.2, 1.4, 4.2, 4.9))
    sheet.path([(4 * math.cos(a), 4 * math.sin(a)) for a in np.linspace(0.5, math.pi - 0.5, 90)], INK, 1.6)
    angles = np.linspace(0.55, math.pi - 0.55, 4)
    miss = 4 * (1 - math.cos((angles[1] - angles[0]) / 2))
    for shift, color, text, y in (
        (0.0, GREY, "vertices on the path: miss on one side", 1.9),
        (miss / 2, BLUE, "vertices moved out: half the miss on either side", 1.6),
    ):
        inner = [(4 + shift) if 0 < k < 3 else 4.0 for k in range(4)]
        sheet.path([(r * math.cos(a), r * math.sin(a)) for r, a in zip(inner, angles, strict=True)], color, 1.8)
        sheet.word((-4.0, y), text, color, size=12)
    return sheet


def corners():
    """A corner in exact stop (G61) and in continuous path (G64) with constant acceleration."""
    sheet = Drawing((-0.6, -0.6, 5.6, 3.6))
    sheet.path([(0, 0), (4, 0), (4, 3.2)], INK, 1.4, "4 4")
    blend = [(4 - 1.5 * (1 - s) ** 2, 1.5 * s**2) for s in np.linspace(0, 1, 30)]
    sheet.path([(0, 0), *blend, (4, 3.2)], RED, 2.2)
    sheet.dot((4, 0), BLUE, 5)
    sheet.word((4.15, -0.1), "G61: stops here", BLUE, size=13)
    sheet.word((1.2, 0.9), "G64: leaves the corner out", RED, size=13)
    sheet.arrow((4, 0), (4 - 1.5 * 0.25, 1.5 * 0.25), GREY, 1.3)
    sheet.word((4.15, 0.45), "contour error", GREY, size=13)
    return sheet


DRAWINGS = {"correction": correction, "equilibrium": equilibrium, "assembly": assembly, "frames": frames,
            "joining": joining, "chords": chords, "corners": corners}  # fmt: skip


def main():
    for name, draw in DRAWINGS.items():
        (FOLDER / f"{name}.svg").write_text(draw().text(), encoding="utf-8")


if __name__ == "__main__":
    main()
