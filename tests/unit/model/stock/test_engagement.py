"""The engagement against closed forms, at the default resolution: angles within 0.5 degrees, depths within 5 um."""

import itertools

import numpy as np
import pytest

from camcomp.ground import path_geometry
from camcomp.model.stock.memory import NO_TOOL, StockMemory
from camcomp.model.stock.places import BENT
from camcomp.model.stock.shapes import StockShape, ToolShape
from camcomp.model.stock.surface import read_heights
from tests.paths import path_of

DEGREES, MICROMETRES = np.radians(0.5), 5e-3
R = 5.0
BLOCK = StockShape(np.array([-50.0, -50.0, -20.0]), np.array([50.0, 50.0, 0.0]))


def memory(kind="flat", stock=BLOCK, cell=None, radius=R, **more):
    return StockMemory(stock, {NO_TOOL: ToolShape(kind, 2.0 * radius, **more)}, cell)


def follow(path, **more):
    return memory(**more).follow(path)[0]


def arcs_at(engaged, motion, u):
    """Arcs (entry, exit, height) and depth at the place of a motion that is nearest to u."""
    rows = np.flatnonzero(engaged.motion == motion)
    row = rows[np.argmin(np.abs(engaged.u[rows] - u))]
    arcs = engaged.arcs.take(np.array([row]))
    return float(engaged.u[row]), np.column_stack((arcs.start, arcs.stop, arcs.height)), float(engaged.depth[row])


def test_a_slot_is_cut_with_the_front_half():
    engaged = follow(path_of(("line", (40, 0, -2)), start=(-40, 0, -2)))
    for u in (0.0, 0.5, 1.0):
        _, arcs, depth = arcs_at(engaged, 0, u)
        np.testing.assert_allclose(arcs[:, :2], [[0.0, np.pi]], atol=DEGREES)
        assert depth == pytest.approx(2.0, abs=MICROMETRES)


@pytest.mark.parametrize("width", [0.1, 1.0, 4.0, 9.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_wall_is_cut_on_its_side(width, side):
    y = 50.0 - width + R
    engaged = follow(path_of(("line", (side * 60, y, -2)), start=(-side * 60, y, -2)))
    turn = np.arccos(1.0 - width / R)
    # material right of the feed along +x: up to the exit at pi; left of it along -x: from the entry at 0
    wanted = [np.pi - turn, np.pi] if side > 0 else [0.0, turn]
    np.testing.assert_allclose(arcs_at(engaged, 0, 0.5)[1][:, :2], [wanted], atol=DEGREES)


def test_a_thin_rib_is_met_by_a_face_mill():
    """The front is looked at two cells apart, however large the tool is."""
    radius, low, high = 30.0, 9.3, 10.1
    rib = StockShape(np.array([-50.0, low, -20.0]), np.array([50.0, high, 0.0]))
    engaged = follow(path_of(("line", (20, 0, -2)), start=(-20, 0, -2)), stock=rib, radius=radius)
    _, arcs, depth = arcs_at(engaged, 0, 0.5)
    np.testing.assert_allclose(arcs[:, :2], [[np.arccos(high / radius), np.arccos(low / radius)]], atol=DEGREES)
    assert depth == pytest.approx(2.0, abs=MICROMETRES)


def front_left(path, motion, u, count=20001):
    """Share of the front half, rad, that no earlier move of a level path with a flat tool has been over; by sampling."""
    start, way = path.start[motion], path.end[motion] - path.start[motion]
    e = way[:2] / np.linalg.norm(way[:2])
    psi = (np.arange(count) + 0.5) / count * np.pi
    q = start[:2] + u * way[:2] + R * (np.cos(psi)[:, None] * [-e[1], e[0]] + np.sin(psi)[:, None] * e)
    free = (np.abs(q) < 50.0).all(axis=1)
    for k in range(motion):
        a, d = path.start[k, :2], path.end[k, :2] - path.start[k, :2]
        if path.kind[k] == 0 or path.end[k, 2] > -1.0:
            continue
        t = np.clip((q - a) @ d / max(d @ d, 1e-12), 0.0, 1.0)
        free &= np.linalg.norm(q - a - t[:, None] * d, axis=1) > R
    return np.pi * free.mean()


def test_the_engagement_rises_in_corners_as_it_does():
    """A pocket from the inside out: along walls, into corners, out of them, by an oracle that knows all earlier moves."""
    at, corners = np.zeros(3) - [0, 0, 2], []
    for k in range(1, 5):
        for x, y in ((3.5 * k, -3.5 * k), (3.5 * k, 3.5 * k), (-3.5 * k, 3.5 * k), (-3.5 * k, -3.5 * k)):
            corners.append(("line", (x, y, -2.0)))
    path = path_of(*corners, start=at)
    engaged = follow(path)
    inner = np.flatnonzero((engaged.u > 1e-4) & (engaged.u < 1.0 - 1e-4))
    assert len(inner) > 100
    wanted = [front_left(path, m, u) for m, u in zip(engaged.motion[inner], engaged.u[inner], strict=True)]
    # a place is known to 1.5 um of the way, and in a corner the engagement rises by more than half a degree on that
    beside = 1.5e-3 / path_geometry.lengths(path)[engaged.motion]
    for row, middle in zip(inner, wanted, strict=True):
        m, u = engaged.motion[row], engaged.u[row]
        near = [middle] if abs(engaged.turn[row] - middle) < DEGREES else [
            front_left(path, m, each) for each in np.clip([u - beside[row], u, u + beside[row]], 0.0, 1.0)
        ]  # fmt: skip
        assert min(near) - DEGREES < engaged.turn[row] < max(near) + DEGREES
    assert np.ptp(wanted) > 1.0


def cut_up(path, length):
    """The straight moves of a path in parts of at most so many mm, and of which move and where on it every part ends."""
    moves, ends = [], []
    for k, whole in enumerate(path_geometry.lengths(path)):
        count = int(np.ceil(whole / length))
        for u in np.arange(1, count + 1) / count:
            moves.append(("line", path.start[k] + u * (path.end[k] - path.start[k])))
            ends.append((k, u))
    return path_of(*moves, start=path.start[0]), ends


def test_corners_are_the_same_in_short_moves():
    corners = [
        (3.5 * k * x, 3.5 * k * y, -2.0) for k in range(1, 4) for x, y in ((1, -0.9), (0.9, 1), (-1, 1), (-1, -1))
    ]
    path = path_of(*(("line", each) for each in corners), start=(0, 0, -2))
    short, ends = cut_up(path, 0.15)
    engaged = follow(short)
    rows = np.flatnonzero(engaged.u == 1.0)
    assert len(rows) == len(short)
    for row in rows[::7]:
        k, u = ends[engaged.motion[row]]
        beside = 0.02 / path_geometry.lengths(path)[k]  # where it jumps is known to so much
        near = [front_left(path, k, each, 4001) for each in np.clip([u - beside, u, u + beside], 0.0, 1.0)]
        assert min(near) - DEGREES < engaged.turn[row] < max(near) + DEGREES, (k, u)


def test_a_circle_inside_a_circle():
    first, second = 12.0, 13.0
    full = 2.0 * np.pi
    path = path_of(
        ("arc", (first, 0, -1), (0, 0, -1), full), ("line", (second, 0, -1)), ("arc", (second, 0, -1), (0, 0, -1), full),
        start=(first, 0, -1),
    )  # fmt: skip
    engaged = follow(path)
    # the tool's edge leaves the first pocket where |p + R n| is its radius
    cosine = ((first + R) ** 2 - second**2 - R**2) / (2.0 * second * R)
    turn = np.arccos(cosine)
    for u in (0.3, 0.5, 0.7):
        _, arcs, _ = arcs_at(engaged, 2, u)
        np.testing.assert_allclose(arcs[:, :2], [[np.pi - turn, np.pi]], atol=DEGREES)


def test_the_same_circle_again_meets_nothing_however_it_is_cut_up():
    full = 2.0 * np.pi
    fine = [("line", (12 * np.cos(a), 12 * np.sin(a), -1)) for a in np.linspace(0, full, 700)[1:]]
    path = path_of(
        ("arc", (12, 0, -1), (0, 0, -1), full), ("arc", (12, 0, -1), (0, 0, -1), full),
        ("arc", (12, 0, -1), (0, 0, -1), -full), *fine, start=(12, 0, -1),
    )  # fmt: skip
    engaged = follow(path)
    assert engaged.turn[engaged.motion == 0].max() == pytest.approx(np.pi, abs=DEGREES)
    assert not engaged.turn[engaged.motion > 0].any()


def test_a_ramp_gets_deeper_along_the_way():
    engaged = follow(path_of(("line", (40, 0, -4)), start=(-40, 0, 0)))
    for u in (0.25, 0.5, 1.0):
        at, arcs, depth = arcs_at(engaged, 0, u)
        assert depth == pytest.approx(4.0 * at, abs=MICROMETRES)
        np.testing.assert_allclose(arcs[:, :2], [[0.0, np.pi]], atol=DEGREES)


def test_a_helix_cuts_one_pitch_after_the_first_turn():
    engaged = follow(path_of(("arc", (3, 0, -2), (0, 0, 0), 4.0 * np.pi), start=(3, 0, 0)))
    for u, depth in ((0.2, 0.4), (0.4, 0.8), (0.7, 1.0), (0.9, 1.0)):
        found = engaged.sizes(np.array([0]), np.array([u]), np.array([False]))[0]
        assert found[0] == pytest.approx(depth, abs=MICROMETRES)


def test_a_ball_on_a_plane_cuts_to_its_depth_in_every_slice():
    depth = 1.0
    engaged = follow(path_of(("line", (40, 0, -depth)), start=(-40, 0, -depth)), kind="ball")
    _, arcs, found = arcs_at(engaged, 0, 0.5)
    assert found == pytest.approx(depth, abs=MICROMETRES)
    np.testing.assert_allclose(arcs[:, :2], np.tile([0.0, np.pi], (len(arcs), 1)), atol=DEGREES)
    assert arcs[:, 2].sum() == pytest.approx(depth, abs=MICROMETRES)


def test_a_ball_beside_its_own_groove_meets_what_stands_on_its_other_side():
    step, depth = 1.0, 1.0
    path = path_of(
        ("line", (46, 0, -depth)), ("rapid", (46, 0, 9)), ("rapid", (-40, step, 9)), ("line", (-40, step, -depth)),
        ("line", (40, step, -depth)), start=(-46, 0, -depth),
    )  # fmt: skip
    engaged = follow(path, kind="ball")
    rows = np.flatnonzero(engaged.motion == 4)[-1:]
    arcs = engaged.arcs.take(rows)
    # the old groove, right of the feed, is in every slice as wide as the ball: y < r takes 1 + r cos(psi) < r away
    top = np.cumsum(arcs.height)
    low = engaged.depth[rows[0]] - top[-1]
    z = low + top - 0.5 * arcs.height
    radius = np.sqrt(R**2 - (R - z) ** 2)
    wanted = np.arccos(np.maximum(1.0 - step / radius, -1.0))
    np.testing.assert_allclose(arcs.stop[1:], wanted[1:], atol=DEGREES)  # the lowest slice is next to the tip
    np.testing.assert_allclose(arcs.start, 0.0, atol=DEGREES)


@pytest.mark.parametrize(("kind", "more"), [("bull", {"corner_mm": 1.0}), ("drill", {})])
def test_other_tips_cut_to_the_same_depth(kind, more):
    engaged = follow(path_of(("line", (40, 0, -3)), start=(-40, 0, -3)), kind=kind, **more)
    _, arcs, depth = arcs_at(engaged, 0, 0.5)
    assert depth == pytest.approx(3.0, abs=MICROMETRES)
    np.testing.assert_allclose(arcs[:, 1] - arcs[:, 0], np.pi, atol=2.0 * DEGREES)


TIPS = [("flat", {}), ("ball", {}), ("bull", {"corner_mm": 1.5}), ("drill", {})]


@pytest.mark.parametrize("slope", [0.0, 0.05, -0.05])
@pytest.mark.parametrize(("kind", "more"), TIPS)
def test_a_move_in_parts_meets_what_it_meets_whole(kind, more, slope):
    """Next to a groove, where one side of the tool is free."""
    begin = [("line", (30, 0, -2)), ("line", (30, 0.7, -2))]
    whole = path_of(*begin, ("line", (20, 0.7, -2 + 10 * slope)), start=(-30, 0, -2))
    parts = [("line", (30 - x, 0.7, -2 + x * slope)) for x in np.linspace(0, 10, 51)[1:]]
    one, many = follow(whole, kind=kind, **more), follow(path_of(*begin, *parts, start=(-30, 0, -2)), kind=kind, **more)
    own = one.motion == 2
    rows = np.flatnonzero((many.u == 1.0) & (many.motion > 11))  # both begin beside where the groove was widened
    u = (many.motion[rows] - 1) / 50
    np.testing.assert_allclose(many.depth[rows], np.interp(u, one.u[own], one.depth[own]), atol=MICROMETRES)
    size = [np.bincount(e.arcs.place, e.arcs.height * (e.arcs.stop - e.arcs.start), len(e.u)) for e in (one, many)]
    missed = 2.0 * BENT * 2.0 * np.pi  # of the slot, the largest engagement; either may miss as much
    np.testing.assert_allclose(size[1][rows], np.interp(u, one.u[own], size[0][own]), atol=missed)


@pytest.mark.parametrize(("kind", "more"), TIPS)
def test_what_many_moves_leave_is_what_the_tool_was_over(kind, more):
    """Short moves with turns, climbs and dives that go on from each other; heights by trying very many places of the tip."""
    rng = np.random.default_rng(1)
    angle = np.cumsum(rng.normal(0.0, 0.4, 60))
    at = np.cumsum(np.column_stack((np.cos(angle), np.sin(angle), rng.normal(0.0, 0.1, 60))) * 0.7, axis=0)
    at = at - at.mean(axis=0) - [0, 0, 2]
    own = memory(kind=kind, radius=2.0, stock=StockShape(np.array([-20.0, -20, -9]), np.array([20.0, 20, 0])), **more)
    own.follow(path_of(*(("line", each) for each in at[1:]), start=at[0]))
    own.settle()
    x = rng.uniform(-12, 12, 300)
    y = rng.uniform(-12, 12, 300)
    found = np.array([[0.0]])
    tips = np.concatenate([a + np.linspace(0, 1, 600)[:, None] * (b - a) for a, b in itertools.pairwise(at)])
    checked = 0
    for px, py in zip(x, y, strict=True):
        read_heights(own.nodes, np.array([px]), np.array([py]), found)
        rho = np.hypot(tips[:, 0] - px, tips[:, 1] - py)
        over = rho <= 2.0
        wanted = min(0.0, float((tips[over, 2] + height_of(kind, rho[over], 2.0)).min(initial=0.0)))
        if abs(rho.min() - 2.0) > 0.01:  # a wall stands there
            assert found[0, 0] == pytest.approx(wanted, abs=MICROMETRES)
            checked += wanted < 0.0
    assert checked > 60


def height_of(kind, rho, radius):
    """Of the tool over its tip."""
    if kind == "flat":
        return np.zeros(len(rho))
    if kind == "drill":
        return rho / np.tan(np.radians(59.0))
    corner = {"ball": radius, "bull": 1.5}[kind]
    return corner - np.sqrt(np.maximum(corner**2 - np.maximum(rho - radius + corner, 0.0) ** 2, 0.0))


def test_a_finer_field_comes_nearer_in_the_first_order():
    """Chords of a hundredth of a millimetre make walls of slivers, which nodes can miss."""
    first, second, n = 6.0, 6.5, 3000
    a = np.linspace(0, 2 * np.pi, n)[1:]
    fine = [("line", (first * np.cos(b), first * np.sin(b), -1)) for b in a]
    path = path_of(
        *fine, ("line", (second, 0, -1)), ("arc", (second, 0, -1), (0, 0, -1), 2 * np.pi), start=(first, 0, -1)
    )
    radius = 1.0
    turn = np.arccos(((first + radius) ** 2 - second**2 - radius**2) / (2.0 * second * radius))
    worst = []
    for cell in (0.4, 0.1):
        engaged = follow(path, radius=radius, cell=cell)
        u = np.linspace(0.2, 0.8, 500)
        found = engaged.sizes(np.full(len(u), n), u, np.zeros(len(u), bool))[1]
        worst.append(np.abs(found - turn).max())
    assert worst[1] < 0.35 * worst[0]
    assert worst[1] < 0.5 * DEGREES


def test_the_end_of_a_slot_is_a_jump():
    path = path_of(
        ("line", (0, 0, -2)), ("rapid", (0, 0, 5)), ("rapid", (-40, 0, 5)), ("line", (-40, 0, -2)), ("line", (40, 0, -2)),
        start=(-40, 0, -2),
    )  # fmt: skip
    engaged = follow(path)
    rows = engaged.motion == 4
    u, turn = engaged.u[rows], engaged.turn[rows]
    jump = np.flatnonzero(np.diff(u) == 0.0)
    assert len(jump) == 1
    assert u[jump[0]] == pytest.approx(0.5, abs=0.03 / 80)
    assert turn[jump[0]] == 0.0 and turn[jump[0] + 1] > 0.8 * np.pi


def test_a_round_bar_ends_where_it_ends():
    from camcomp.model.stock.field import ROUND

    bar = StockShape(np.array([-20.0, -20.0, -10.0]), np.array([20.0, 20.0, 0.0]), ROUND)
    engaged = follow(path_of(("line", (40, 0, -2)), start=(-40, 0, -2)), stock=bar)
    on = engaged.turn > 0.0
    x = -40.0 + 80.0 * engaged.u[on]
    assert x.min() == pytest.approx(-20.0 - R, abs=0.01)  # the front of the tool touches first
    assert x.max() == pytest.approx(20.0 - R + R, abs=R)


def test_rapids_through_what_stands_are_named_and_others_are_not():
    path = path_of(
        ("line", (0, 0, -2)), ("rapid", (-30, 0, -2)), ("rapid", (-30, 20, -2)), ("rapid", (-30, 20, 1)),
        ("rapid", (30, 20, 1)), start=(-30, 0, -2),
    )  # fmt: skip
    assert memory().follow(path)[1].tolist() == [2, 3]


def test_what_is_shown_in_parts_is_as_in_one():
    full = 2.0 * np.pi
    moves = [
        ("line", (20, 0, -1)),
        ("arc", (20, 0, -1), (10, 0, -1), full),
        ("line", (20.0, 1.0, -1)),
        ("line", (-20, 2, -1)),
    ]
    path = path_of(*moves, start=(0, 0, -1))
    whole = follow(path)
    parts = memory()
    for k in range(len(path)):
        last = min(k + 1, len(path) - 1)
        engaged, _ = parts.follow(path.take(np.arange(k, last + 1)), ahead=last - k)
        own, there = engaged.motion == 0, whole.motion == k
        np.testing.assert_allclose(engaged.u[own], whole.u[there])
        np.testing.assert_allclose(engaged.turn[own], whole.turn[there], atol=1e-9)


def test_places_that_no_sweep_owns_any_more_are_used_again():
    long = memory()
    moves = [("line", (x, y, -0.01 * k)) for k in range(30) for x, y in ((0, 0), (3, 0), (3, 3), (0, 3))]
    long.follow(path_of(*moves, start=(0, 3, 0)))
    used = int(long.nodes.counts[0] - long.nodes.counts[1])
    assert used < 60 < len(moves)
