"""Motion by motion: camcomp's path of a program against the canonical motions of rs274."""

import math

import numpy as np

from camcomp.gcode.arcs import PLANES
from camcomp.gcode.program import Program
from camcomp.ground.datatypes import ARC, RAPID
from tests.oracles.rs274 import Motion, Run

STILL = (
    2e-3,
    2.37e-3,
    1.5e-3,
)  # shorter is no motion, in the active unit; the others for a motion that is just as long
PRINTED = 0.5001e-4  # half of the last digit that rs274 prints, in the active unit


def moving(run: Run, least: float) -> list[Motion]:
    """Canonical motions without the empty feeds that rs274 prints for a `G1 F100` without axis words."""
    kept, last = [], (0.0, 0.0, 0.0)
    for each in run.motions:
        place = tuple((each.end[a] + each.offset[a]) * each.unit for a in range(3))
        still = each.kind in ("FEED", "TRAVERSE") and math.dist(place, last) < least * each.unit
        if not still:
            kept.append(each)
        last = place
    return kept


def difference(program: Program, run: Run) -> str:
    """Differences of motions; empty when every motion agrees to the printed digits."""
    path, sites = program.path, program.sites
    local = (path.end - sites.offset) / sites.unit[:, None]
    length = np.where(path.kind == ARC, np.inf, np.linalg.norm(path.end - path.start, axis=1)) / sites.unit
    for least in STILL:
        ours, theirs = np.flatnonzero(~(length < least)), moving(run, least)
        if len(ours) == len(theirs):
            break
    else:
        return f"{len(ours)} motions, rs274 has {len(theirs)}"
    for k, other in zip(ours, theirs, strict=True):
        where = f"line {path.line[k]}, {other.call}"
        kind = "ARC" if path.kind[k] == ARC else "TRAVERSE" if path.kind[k] == RAPID else "FEED"
        if kind != other.kind:
            return f"{where}: kind {kind}"
        if sites.unit[k] != other.unit:
            return f"{where}: unit {sites.unit[k]}"
        if np.abs(local[k] - other.end).max() > PRINTED + 1e-12 * np.abs(local[k]).max():
            return f"{where}: end {local[k].tolist()}"
        total = np.array(other.offset) * other.unit
        if np.abs(sites.offset[k] - total).max() > 3.0 * PRINTED * 25.4:
            return f"{where}: offset {sites.offset[k].tolist()}, rs274 {total.tolist()}"
        if kind == "ARC":
            u, v, _ = PLANES[int(sites.plane[k])]
            centre = (path.centre[k] - sites.offset[k]) / sites.unit[k]
            if max(abs(centre[u] - other.centre[0]), abs(centre[v] - other.centre[1])) > PRINTED:
                return f"{where}: centre {centre.tolist()}"
            turns = math.copysign(max(1, math.ceil(abs(path.angle[k]) / (2 * math.pi) - 1e-9)), path.angle[k])
            if turns != other.turns or sites.plane[k] != other.plane:
                return f"{where}: turns {turns}, plane {sites.plane[k]}"
        if kind != "TRAVERSE" and sites.feed_mode[k] != 95:
            feed = path.feed[k]
            if (
                sites.feed_mode[k] == 93
            ):  # LinuxCNC moves at no less than 0.1 units a minute there; camcomp keeps what is written
                feed = max(feed, 0.1 * sites.unit[k])
            if abs(feed - other.feed) > 25.4e-4 + 1e-4 * feed:
                return f"{where}: feed {feed}, rs274 {other.feed}"
    return ""
