"""Forces along straight moves whose engagement is known, compiled: what cutting/track.py and piece_load.py do for all motions."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math

from camcomp.ground.compiled import entry, inner
from camcomp.ground.datatypes import RAPID
from camcomp.model.cutting.track import NO_FORCE, SAME_FORCE
from camcomp.model.statics.vectors import cross, dot, part, plus


@inner
def path_force(t, axis, components):
    """Force (3,) of components (Fr, Ft, Fz) for the unit feed direction t, and the sine of t to the tool axis."""
    across = plus(t, axis, -dot(t, axis))
    size = math.sqrt(dot(across, across))
    if not size > 1e-6:
        return (0.0, 0.0, 0.0), size
    x = (across[0] / size, across[1] / size, across[2] / size)
    right = cross(x, axis)
    a, b, c = components[0], components[1], components[2]
    return (
        a * right[0] + b * x[0] + c * axis[0],
        a * right[1] + b * x[1] + c * axis[1],
        a * right[2] + b * x[2] + c * axis[2],
    ), size


@inner
def set_row(out, i, v):
    """Fills row i of out (n, 3)."""
    out[i, 0], out[i, 1], out[i, 2] = v


@inner
def size_of(v):
    """Length of a vector (3,)."""
    return math.sqrt(dot(v, v))


@inner
def line_between(base, left, right, w):
    """Point at share w between two rows of base (k, 3)."""
    return plus(part(base[left], 0), plus(part(base[right], 0), part(base[left], 0), -1.0), w)


@entry
def lay_engaged(
    kind, of, u0, u1, start, end, axis, motion, u, turn, base, join_cosine, plunge_sine, f0, f1, jump, length
):
    """Fills forces at the begin and the end of parts (p,) of moves, f0 and f1 (p, 3), where they jump (p + 1,), their length.

    of, u0, u1 (p,): which part of which move; start, end (p, 3). motion, u, turn (k,), base (k, 3): places of the
    engagement in order, its arcs there, Fr, Ft, Fz. A feed move without length keeps the force before it.
    """
    axis, zero = part(axis, 0), (0.0, 0.0, 0.0)
    places, right, before = motion.shape[0], 0, -1
    last = base_before = own_before = zero
    cut_before = False
    jump[0] = False
    for i in range(of.shape[0]):
        jump[i + 1] = False
        t = plus(part(end[i], 0), part(start[i], 0), -1.0)
        size = size_of(t)
        length[i] = size
        if not size > 0.0 and kind[i] != RAPID:
            for k in range(3):
                f0[i, k] = f1[before, k] if before >= 0 else 0.0
                f1[i, k] = f0[i, k]
            continue
        first = final = zero
        cuts = False
        if size > 0.0:
            t = (t[0] / size, t[1] / size, t[2] / size)
        own0 = own1 = zero
        if size > 0.0 and kind[i] != RAPID:
            at = 0.5 * (u0[i] + u1[i])
            while right < places and (motion[right] < of[i] or (motion[right] == of[i] and u[right] < at)):
                right += 1
            left = right - 1
            known = left >= 0 and right < places and motion[left] == of[i] and motion[right] == of[i]
            _, sine = path_force(t, axis, zero)
            if known and (turn[left] > 0.0 or turn[right] > 0.0) and sine > plunge_sine:
                cuts = True
                span = u[right] - u[left]
                span = span if span > 0.0 else 1.0
                first = line_between(base, left, right, min(max((u0[i] - u[left]) / span, 0.0), 1.0))
                final = line_between(base, left, right, min(max((u1[i] - u[left]) / span, 0.0), 1.0))
                own0, _ = path_force(t, axis, first)
                own1, _ = path_force(t, axis, final)
        set_row(f0, i, own0)
        set_row(f1, i, own1)
        if before >= 0:
            smooth = cuts and cut_before and dot(last, t) >= join_cosine
            if smooth:
                middle = plus(last, t, 1.0)
                size = size_of(middle)
                middle = (middle[0] / size, middle[1] / size, middle[2] / size)
                ahead, _ = path_force(middle, axis, base_before)
                behind, _ = path_force(middle, axis, first)
                smooth = size_of(plus(behind, ahead, -1.0)) <= SAME_FORCE * size_of(ahead) + NO_FORCE
                if smooth:
                    shared = plus(ahead, plus(behind, ahead, -1.0), 0.5)
                    set_row(f1, before, shared)
                    set_row(f0, i, shared)
                    for j in range(before + 1, i):  # moves without length in between
                        set_row(f0, j, shared)
                        set_row(f1, j, shared)
            if not smooth:
                jump[i] = size_of(plus(own0, own_before, -1.0)) > NO_FORCE
        elif i > 0:
            jump[i] = size_of(own0) > NO_FORCE
        before = i
        last = t
        base_before = final
        own_before = own1
        cut_before = cuts
