"""Which runs an experiment has, and the programs they execute.  Places, sizes and feeds vary from seed to seed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Planned:
    """One run to be executed: program text and whether it cuts."""

    program: str
    cutting: bool


def _frame(body: list[str], first: tuple[float, float, float], plunge: bool, numbered: bool) -> str:
    x, y, z = first
    lines = ["(groove test)", "G21 G90 G17 G94", "S8000 M3"]
    if plunge:
        lines += [f"G0 X{x:.3f} Y{y:.3f} Z{z + 4:.3f}", f"G1 Z{z:.3f} F300"]
    else:
        lines += [f"G0 X{x:.3f} Y{y:.3f} Z{z:.3f}"]
    lines += body + [f"G0 Z{z + 20:.3f}", "M5", "M30"]
    if numbered:
        lines = [t if t.startswith("(") else f"N{10 * i} {t}" for i, t in enumerate(lines, 1)]
    return "\n".join(lines) + "\n"


def circle(radius: float, feed: float, clockwise: bool, centre=(0.0, 0.0), z=0.0, plunge=True, numbered=False) -> str:
    """One full circle from its +x point."""
    x, y = centre
    code = "G2" if clockwise else "G3"
    body = [f"{code} X{x + radius:.3f} Y{y:.3f} I{-radius:.3f} J0 F{feed:.0f}"]
    return _frame(body, (x + radius, y, z), plunge, numbered)


def zigzag(size: float, rows: int, feed: float, centre=(0.0, 0.0), z=0.0, plunge=True, numbered=False) -> str:
    """Rows along x, joined by short steps along y."""
    xs, ys = centre[0] + np.array([-size, size]), centre[1] + np.linspace(-size, size, rows)
    body, side = [], 1
    for i, y in enumerate(ys):
        if i:
            body.append(f"G1 Y{y:.3f} F{feed:.0f}")
        body.append(f"G1 X{xs[side]:.3f} F{feed:.0f}")
        side = 1 - side
    return _frame(body, (xs[0], ys[0], z), plunge, numbered)


def rectangle(width: float, height: float, feed: float, centre=(0.0, 0.0), z=0.0, plunge=True, numbered=False) -> str:
    """Once round, counter-clockwise from the lower left corner."""
    x0, y0, x1, y1 = (
        centre[0] - width / 2,
        centre[1] - height / 2,
        centre[0] + width / 2,
        centre[1] + height / 2,
    )
    body = [f"G1 X{x1:.3f} F{feed:.0f}", f"G1 Y{y1:.3f}", f"G1 X{x0:.3f}", f"G1 Y{y0:.3f}"]
    return _frame(body, (x0, y0, z), plunge, numbered)


DESIGNS = ("six", "circle", "both-ways", "four")


def plan(design: str, rng: np.random.Generator) -> list[Planned]:
    """Runs of a design in the order in which they are executed."""
    radius, feed = float(rng.choice([20.0, 25.0, 25.0, 30.0])), float(rng.choice([600.0, 800.0, 1000.0]))
    common = {"plunge": bool(rng.integers(2)), "numbered": bool(rng.integers(2))}
    level = float(rng.choice([0.0, 0.0, 0.0, -5.0, 8.0]))
    ccw = Planned(circle(radius, feed, False, **common), True)
    cw = Planned(circle(radius, feed, True, **common), True)
    fast = Planned(circle(radius, 3 * feed, False, **common), True)
    air = Planned(circle(radius, feed, False, **common), False)
    rows = Planned(zigzag(0.8 * radius, 5, feed, z=level, **common), True)
    round_ = Planned(rectangle(1.6 * radius, 1.2 * radius, feed, z=level, **common), True)
    runs = {
        "six": [ccw, cw, fast, air, rows, round_],
        "circle": [ccw],
        "both-ways": [ccw, cw],
        "four": [ccw, cw, fast, air],
    }[design]
    order = rng.permutation(len(runs))
    return [runs[i] for i in order]
