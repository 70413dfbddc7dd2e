"""Programs that are compensated and then recorded: five shapes in four path modes, at two feeds."""

from __future__ import annotations

import math

MODES = {"g61": "G61", "g64": "G64", "p1": "G64 P0.001", "p10": "G64 P0.01"}
FEEDS = (600, 3000)
CONFIG = "config/orthoglide-1deg.yaml"
CONTROL = {
    "control": {"start_mm": [0.0, 0.0, 20.0], "velocity_mm_per_s": 100.0}
}  # as tests/validation/recordings drives it


def circle(radius: float, feed: int) -> list[str]:
    """A groove, counter-clockwise."""
    begin = [f"G0 X{radius:g} Y0 Z5", "G1 Z0 F400"]
    return [*begin, f"G3 X{radius:g} Y0 I{-radius:g} J0 F{feed}", "G1 Z5 F1000"]


def rectangle(feed: int) -> list[str]:
    """40 mm by 30 mm with sharp corners."""
    return ["G0 X-20 Y-15 Z5", "G1 Z0 F400", f"G1 X20 F{feed}", "Y15", "X-20", "Y-15", "G1 Z5 F1000"]


def raster(feed: int, lines: int) -> list[str]:
    """Ten rows over a wavy surface."""

    def height(x: float, y: float) -> float:
        return 0.5 * (math.sin(x / 6 + y / 5) * math.cos(x / 9) - math.sin(-25 / 6 - 9 / 5) * math.cos(25 / 9)) - 1

    along = lines // 10
    out = ["G0 X-25 Y-9 Z5", f"G1 Z{height(-25, -9):.4f} F400"]
    for row in range(10):
        places = [-25 + 50 * i / along for i in range(along + 1)]
        y = -9 + 2 * row
        for x in places[::-1] if row % 2 else places:
            out.append(f"X{x:.4f} Y{y} Z{height(x, y):.4f}")
    del out[2]  # where the plunge ended
    out[2] = f"G1 {out[2]} F{feed}"
    return [*out, "G1 Z5 F1000"]


def surface(feed: int, lines: int) -> list[str]:
    """A spiral of six turns, or as many as the lines allow, on a paraboloid."""
    turns = 6 * lines / 1500
    out = ["G0 X20 Y0 Z5", "G1 Z-2 F400"]
    for i in range(1, lines + 1):
        angle, radius = turns * 2 * math.pi * i / lines, 20 - 12 * i / lines
        z = -2 + 1.5 * (1 - (radius / 20) ** 2)
        out.append(f"X{radius * math.cos(angle):.4f} Y{radius * math.sin(angle):.4f} Z{z:.4f}")
    out[2] = f"G1 {out[2]} F{feed}"
    return [*out, "G1 Z5 F1000"]


SHAPES = {
    "circle50": lambda feed: circle(25.0, feed),
    "circle2": lambda feed: circle(1.0, feed),
    "rectangle": rectangle,
    "raster": lambda feed: raster(feed, 5000),
    "surface": lambda feed: surface(feed, 1500),
    "raster500": lambda feed: raster(feed, 500),
    "surface300": lambda feed: surface(feed, 300),
}
WAYS = {"": None, "lines": False}  # arcs where they are better, or never
LONG = [f"{shape}-{mode}-f{feed}" for shape in list(SHAPES)[:5] for mode in MODES for feed in FEEDS]
LONG += [f"{shape}lines-{mode}-f{feed}" for shape in ("circle50", "circle2") for mode in MODES for feed in FEEDS]
SHORT = [
    *("circle50-g61-f3000", "circle50-p10-f3000", "circle50lines-g64-f3000", "circle50lines-p10-f3000"),
    *("circle2-g61-f3000", "circle2-p1-f3000", "circle2-p10-f600", "circle2-g64-f600"),
    *(f"rectangle-{mode}-f3000" for mode in MODES),
    *("raster500-g61-f3000", "raster500-g64-f3000", "raster500-p10-f3000"),
    *("surface300-p1-f3000", "surface300-p10-f3000"),
    *("raster500apart-p10-f3000", "surface300apart-p10-f3000", "surface300-p10-f600", "circle2-p10-f3000"),
]  # what stands in data/
# Those of p10 at F3000 that have a namesake with "apart" were recorded before compensate kept lines from being made one. They stay
# because nothing else shows what merging does to corrected programs; recorded anew they would be what the namesake is.


def source(name: str) -> str:
    """The program before it is compensated."""
    shape, mode, feed = name.split("-")
    lines = SHAPES[shape.removesuffix("lines").removesuffix("apart")](int(feed[1:]))
    return "\n".join(["G21 G90 G17 G94", MODES[mode], "S8000 M3", *lines, "M5", "M2", ""])


def arcs(name: str) -> bool | None:
    """What --arcs is asked to do."""
    return False if name.split("-")[0].endswith("lines") else None
