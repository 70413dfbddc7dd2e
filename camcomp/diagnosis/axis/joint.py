"""Channels of one axis for the model of every log: following error and drive torque of a hinge, second encoder of any axis.

    encoder - set-point = control effects + a q'' + c tanh(q'/v0) + o + w1 sin q + w2 cos q + e    q: behind these effects
    load - encoder      = play, springs, screws + o + d q' + f tau + e        d: delay between two encoders; f tau: compliance
    drive torque        = friction + J q'' + bodies(q, q', q'') + o + e

Bodies are linear in masses, first moments and inertias of the links behind a joint, whatever these are.

Source: Siciliano et al., Robotics, 7.3; `channel_fit` for the choice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from camcomp.diagnosis.axis.channel_data import (
    ACCELERATION,
    BETWEEN,
    BODIES,
    MASSES,
    TURNING,
    ChannelData,
    base_of,
    healthy_sizes,
)
from camcomp.diagnosis.axis.channel_fit import ChannelFit, fit_channel
from camcomp.diagnosis.axis.disturbance_window import Window, find_window, rising, seen_elsewhere, sharp
from camcomp.diagnosis.axis.effect_columns import LOAD, AxisCause, DrivenAxis, candidates
from camcomp.diagnosis.axis.findings import AxisChannel, AxisFindings, AxisRun, ChannelRun, lever_mm
from camcomp.diagnosis.axis.gate import WITHIN, AxisGate, judge, not_known
from camcomp.diagnosis.axis.linear_sets import CAUSES
from camcomp.diagnosis.axis.noise_floor import left_of_fit, log_gain
from camcomp.diagnosis.axis.surroundings import AxisSurroundings
from camcomp.diagnosis.axis.terms import TURNS_MM_PER_S, AxisTravel, ripple
from camcomp.diagnosis.law.words import law_sum
from camcomp.diagnosis.model.noise import MINOR
from camcomp.diagnosis.result.types import LawPart
from camcomp.ground import shelf
from camcomp.ground.datatypes import Bools, Floats
from camcomp.model.hysteresis import PRESLIDING_MM
from camcomp.model.law.expression import washout

TURNS_MM = (1e-4, 0.003, 0.02, 0.1)  # ways over which the friction of a slide turns round in its following error
DEFLECTS = ("friction", "weight", "asymmetry", MASSES)  # kinds that act on a loop
INTEGRAL_S = (0.02, 0.06, 0.2)  # in which an integrator of the loop may take over what deflects it
CORNERS = (0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0)  # times the speed at which a hinge's friction turns round: of a polygon
# of the fastest row: speeds at which the friction of a hinge turns round in its following error
CREEP = (0.005, 0.01, 0.02, 0.05)


def study_channel(found: AxisFindings, rows: ChannelData, around: AxisSurroundings, without: set[str]) -> AxisChannel:
    """One more channel of an axis; its causes and what else it shows go into the findings."""
    force, following = rows.channel == "force", rows.channel == "following"
    seen, axes = rows.seen, [around.driven(found.name, run) for run in rows.runs]
    if force:
        axes = [replace(a, way=_way(a.run, m, on)) for a, m, on in zip(axes, rows.moves, seen, strict=True)]
    healthy, inertia, turned = _healthy(found, rows, around, axes)
    fitted = [axes[k] for k in rows.train]
    terms = candidates(around.robot, fitted, rows.channel, sorted(without), ahead=rows.ahead, turned=turned)

    def response(k: int, acting: Sequence[tuple[AxisCause, Floats]]) -> Floats:
        causes = [term.cause(own.tolist()) for term, own in acting if term.run in (None, rows.runs[k].name)]
        return axes[k].channel(rows.channel, causes)[seen[k]] if causes else np.zeros(len(rows.values[k]))

    def deflected(k: int, acting: Sequence[tuple[AxisCause, Floats]]) -> dict[str, Floats]:
        if not following:
            return {}
        causes = [term.cause(own.tolist()) for term, own in acting]
        return {
            kind: axes[k].deflected(rows.moves[k].time, own, causes)
            for kind, own in healthy[k].items()
            if kind in DEFLECTS
        }

    data = replace(
        rows, deflected=deflected, healthy=healthy, inertia=inertia, covariates=_covariates(found, rows, around), response=response,
        clock=WITHIN * _step(rows.moves) if force else 0.0,
        level=0.0 if following else float(np.mean(np.concatenate([rows.values[k] for k in rows.train]))),
    )  # fmt: skip
    done = fit_channel(data, terms)
    sure = [np.ones(len(each), bool) for each in rows.values]
    if following:
        texts = _following_laws(rows) | ({MASSES: (LOAD,)} if MASSES in done.sizes else {})
        behind = [term.cause(own.tolist()) for term, own in done.acting]
        done = _behind_causes(data, done, texts, [axes[k].laws(_all(texts), behind)[own] for k, own in enumerate(seen)])
        found.laws = [_written_law(found, texts, done.sizes)]
        told = {k: axes[k].known(behind)[seen[k]] for k in rows.test if behind}  # other rows say nothing of the causes
        sure = [told[k] if k in told and told[k].any() else own for k, own in enumerate(sure)]
    if force and "disturbance" not in without:
        done = _with_pushes(found.name, data, terms, done)
        done = _with_pushes_where_judged(found.name, data, done)
    if rows.channel == "behind":  # without zeros and clocks of two encoders, the rest is an error of the machine
        apart = [sum(own[kind] @ done.sizes[kind] for kind in ("offset", "delay")) for own in data.healthy]
        data = replace(data, values=[each - own for each, own in zip(data.values, apart, strict=True)])
        data = replace(data, whole=[(m.time, own) for m, own in zip(data.moves, data.values, strict=True)])
    channel = _channel(data, done, sure)
    _tell(found, data, done)
    if not force and float(np.std(channel.rows)) <= rows.floor:  # there is no gap that causes would explain
        found.laws = [] if following else found.laws
        return replace(channel, gate=AxisGate("at", 0.0, ()), runs=[replace(r, left=r.gap) for r in channel.runs])
    if force and not rows.hinge:
        _find_ripple(found, channel)
    if channel.gate.word == "open" and done.drivers:
        channel.gate = replace(channel.gate, word="above")  # the size does not tell, a covariate does
    found.unknown_chance = min(found.unknown_chance, channel.gate.chance)
    if channel.gate.above:
        found.unknown_in += sorted((done.drivers or done.hints).items(), key=lambda each: -each[1])
    channel.unmodelled = done.unmodelled
    found.causes += done.causes
    found.imitated |= {c.effect: p for c, p in zip(done.causes, done.imitated, strict=False)}
    return channel


def _find_ripple(found: AxisFindings, channel: AxisChannel) -> None:
    """A line of the residual of a drive force over the travel, where it is larger than on healthy machines."""
    line = ripple([r.move for r in channel.fitted], channel.left, channel.columns)
    if line is None or line.amplitude**2 / 2.0 <= (MINOR * channel.floor) ** 2:
        return
    found.ripple = line
    phase = 2.0 * np.pi * np.concatenate([r.move.position for r in channel.fitted]) / line.period
    waves = np.column_stack([np.sin(phase), np.cos(phase)])
    odds = log_gain(np.concatenate(channel.left), channel.columns, waves, channel.floor) - np.log(line.tried)
    found.unknown_chance = min(found.unknown_chance, float(-odds / np.log(10.0)))


def _taken_over(friction: Floats, move: AxisTravel) -> Floats:
    """Columns of friction, and what the integrator of a loop leaves of every other one of them.

    A PI controller of the speed makes s / (s + 1 / T) of a force (Gross, Hamann, Wiegaertner: Electrical feed drives in
    automation); whether there is one, and its T, the rows tell.
    """
    return np.hstack([friction, *(washout(move.time, friction[:, ::2], T) for T in INTEGRAL_S)])


def _following_laws(rows: ChannelData) -> dict[str, tuple[str, ...]]:
    """Formulas of the sizes that every axis has in its following error, by kind, over its motion behind effects of the control.

    The speed is that of a lag too small or too unsure to be a cause.
    """
    laws = _laws_without_integrator(rows)
    taken_over = [f"washout({each}, {T:g})" for T in INTEGRAL_S for each in laws["friction"][::2]]
    return laws | {"friction": (*laws["friction"], *taken_over)}


def _laws_without_integrator(rows: ChannelData) -> dict[str, tuple[str, ...]]:
    """Formulas by kind where the loop has no integrator."""
    hinge = rows.hinge
    place = "followed_rad" if hinge else "followed_mm"
    out = {"acceleration": (f"{place}_per_s2",), "speed": (f"{place}_per_s",), "offset": ("1",)}
    if rows.asymmetric:
        out["asymmetry"] = (f"abs({place}_per_s)",)
    if not hinge:
        return out | {"friction": tuple(f"way({place}, {each:g})" for each in TURNS_MM)}
    return out | {
        "friction": tuple(f"tanh({place}_per_s/{each:.6g})" for each in _creep(rows) / lever_mm(hinge)),
        "weight": (f"sin({place})", f"cos({place})"),
    }


def _creep(rows: ChannelData) -> Floats:
    """Speeds (q,) at which the friction of a hinge turns round in its following error, in the study's mm/s."""
    return np.maximum(np.array(CREEP) * rows.fastest, 1e-12)


def _all(texts: Mapping[str, Sequence[str]]) -> list[str]:
    return [text for own in texts.values() for text in own]


def _behind_causes(
    data: ChannelData, done: ChannelFit, texts: Mapping[str, Sequence[str]], columns: Sequence[Floats]
) -> ChannelFit:
    """The fit of a following error with the residual of its written laws and causes. columns (n, q): of the laws, per run."""
    rest = [values - data.response(k, done.acting) for k, values in enumerate(data.values)]
    data = data.with_misfit(data.in_floors(dict(enumerate(done.left))))
    rows, values = (data.in_floors(dict(enumerate(each))) for each in (columns, rest))
    sizes, covariance = healthy_sizes(rows, values, data.floor)
    left = [own - each @ sizes for own, each in zip(rest, columns, strict=True)]
    ends = np.cumsum([len(own) for own in texts.values()])[:-1]
    by_kind = dict(zip(texts, np.split(sizes, ends), strict=True))
    return replace(done, sizes=by_kind, covariance=covariance, left=left)


def _written_law(found: AxisFindings, texts: Mapping[str, Sequence[str]], sizes: Mapping[str, Floats]) -> LawPart:
    """The entry of a machine file for healthy sizes of a following error; it holds at any motion."""
    amounts = [float(v) for kind in texts for v in sizes[kind]]
    formula = law_sum(list(zip(amounts, _all(texts), strict=True)))
    return LawPart(effect="formula", stage="control", target=found.name, axis=None, envelope={}, formula=formula)


def _step(moves: Sequence[AxisTravel]) -> float:
    """Usual time between two rows, s."""
    return float(np.median(np.concatenate([np.diff(m.time) for m in moves])))


def _way(run: AxisRun, moved: AxisTravel, seen: np.ndarray) -> Floats:
    """Positions (n,) of a run by its motion; between the rows of that as a straight line."""
    way, first = np.interp(run.time, moved.time, moved.position), int(np.argmax(seen))
    before = moved.before[max(len(moved.before) - first, 0) :]
    way[: first - len(before)] = before[0] if len(before) else way[0]
    way[first - len(before) : first] = before
    return np.asarray(way)


def _healthy(
    found: AxisFindings, rows: ChannelData, around: AxisSurroundings, axes: Sequence[DrivenAxis]
) -> tuple[list[dict[str, Floats]], list[dict[str, Floats]], float]:
    """Columns of the sizes that every axis has, by kind, of every run, those that are force of inertia alone, and the speed, mm/s or
    rad/s, up to which friction may turn round in a drive force.
    """
    seen, hinge, force = rows.seen, rows.hinge, rows.channel == "force"
    forces = [run.force[on] for run, on in zip(rows.runs, seen, strict=True)]
    loads = [np.stack([a.weight[on], a.inertia[on]], axis=1) for a, on in zip(axes, seen, strict=True)]
    behind = force and hinge
    bodies = [
        around.bodies(found.name, *each, found.wide) for each in zip(rows.runs, rows.moves, strict=True) if behind
    ]
    base = base_of([bodies[k][0] for k in rows.train if behind] or [np.zeros((1, 0))])
    turns = _turns_at(rows, [bodies[k][0] @ base for k in rows.train]) if behind else 0.0
    out, inertia = [], []
    for k, m in enumerate(rows.moves):
        angle = m.position / lever_mm(True)
        weight = np.stack([np.sin(angle), np.cos(angle)], axis=1)
        own = {"offset": np.ones((len(m.time), 1))}
        if rows.channel == "behind":
            own |= {"eccentricity": weight} if hinge else {}
            own["delay"] = m.speed[:, None]
            own |= {} if axes[k].inertia.any() else {"inertia": m.acceleration[:, None]}  # of masses that nobody states
            own |= {"compliance": forces[k][:, None]} if all(np.isfinite(each).all() for each in forces) else {}
        else:
            own[ACCELERATION] = m.acceleration[:, None]
        if rows.channel == "following" and hinge:
            own |= {"friction": _taken_over(np.tanh(m.speed[:, None] / _creep(rows)), m), "weight": weight}
            own |= {MASSES: axes[k].load(m.time, m.position)[:, None]} if axes[k].stated_loads else {}
        elif rows.channel == "following":
            own["friction"] = _taken_over(np.stack([m.reversal(way) for way in TURNS_MM], axis=1), m)
        if rows.asymmetric:
            own["asymmetry"] = np.abs(m.speed)[:, None]
        if rows.between:
            straight = len(axes[k].asked.time) == len(rows.runs[k].asked[0])  # no instants between rows
            own[BETWEEN] = straight * rows.between[k]
        if force:
            own[TURNING] = _turning(m, turns)
        moved = {kind: own[kind] for kind in own if kind == ACCELERATION}
        if force and hinge:
            every, still = bodies[k]
            own[BODIES], moved[BODIES] = every @ base, (every - still) @ base
            if all(np.ptp(each, axis=0).any() for each in loads):
                own["stated masses"], moved["stated masses"] = loads[k], loads[k] * [0.0, 1.0]
        out.append(own)
        inertia.append(moved)
    return out, inertia, CORNERS[-1] * turns / lever_mm(hinge) if hinge else TURNS_MM_PER_S[-1]


def _turns_at(rows: ChannelData, bodies: Sequence[Floats]) -> float:
    """Speed at which the friction of a hinge turns round: v_0 of the tanh(v / v_0) that leaves least of the fitted runs' torque.

    It is among the speeds below which a quarter, an eighth, a sixteenth and so on of the rows are. bodies (n, b) per fitted run.
    """
    moves = [rows.moves[k] for k in rows.train]
    torque = np.concatenate([rows.values[k] for k in rows.train])
    speed, acceleration = np.concatenate([m.speed for m in moves]), np.concatenate([m.acceleration for m in moves])
    shares = 0.5 ** np.arange(2.0, np.log2(len(speed)))
    scales = np.maximum(np.quantile(np.abs(speed), shares), 1e-12)
    others = np.column_stack([np.ones(len(speed)), speed, acceleration, np.concatenate(bodies)])
    left = left_of_fit(others, np.column_stack([torque, np.tanh(speed[:, None] / scales)]))
    square = np.sum(left[:, 1:] ** 2, axis=0)
    gain = np.divide((left[:, 0] @ left[:, 1:]) ** 2, square, out=np.zeros(len(scales)), where=square > 0.0)
    return float(scales[np.argmax(gain)])


def _turning(m: AxisTravel, turns: float) -> Floats:
    """Friction that turns round with the speed, minus the one that does over a distance, (n, q).

    turns: speed about which it does by any polygon, in a hinge; 0 in a slide, where it may do at several speeds.
    """
    speed = m.speed[:, None]
    if turns == 0.0:
        turned = np.tanh(speed / TURNS_MM_PER_S)
    else:
        turned = np.clip(speed / (turns * np.array(CORNERS)), -1.0, 1.0)
    return np.asarray(turned - m.reversal(PRESLIDING_MM)[:, None])


def _covariates(found: AxisFindings, rows: ChannelData, around: AxisSurroundings) -> list[dict[str, Floats]]:
    out = []
    for run, m in zip(rows.runs, rows.moves, strict=True):
        own = {"position": m.position, "velocity": m.speed, "acceleration": m.acceleration, "time": m.time - m.time[0]}
        each = {f"{kind}:{found.name}": values for kind, values in own.items()}
        for name, other in around.others(found.name, run, found.wide).items():
            for kind in ("velocity", "acceleration"):
                values = other.speed if kind == "velocity" else other.acceleration
                each[f"{kind}:{name}"] = np.interp(m.time, other.time, values)
        out.append(each)
    common = set.intersection(*(set(each) for each in out))
    return [{name: own[name] for name in own if name in common} for own in out]


def _with_pushes(name: str, data: ChannelData, terms: Sequence[AxisCause], done: ChannelFit) -> ChannelFit:
    """The fit jointly with disturbance forces, as long as the evidence takes one more."""
    pushes: list[AxisCause] = []
    for _ in range(CAUSES):
        beside = {k: data.healthy_columns(k) for k in data.train}
        left = {k: done.left[k] for k in data.train}
        found = find_window(left, beside, {k: data.moves[k].time for k in left}, data.floor)
        if found is None:
            break
        window, rest = found
        if not (sharp(window, rest, data.moves[window.run].time) or seen_elsewhere(window, data.moves)):
            break
        more = [*pushes, _push(name, window, data)]
        again = fit_channel(data, [*terms, *more])
        if sum(c.effect == "disturbance" for c in again.causes) < len(more):
            break
        done, pushes = again, more
    return done


def _with_pushes_where_judged(name: str, data: ChannelData, done: ChannelFit) -> ChannelFit:
    """The fit with the disturbance forces of runs that are judged only, from the residual of each."""
    known = data.refined(done.left, done.sizes)
    for k in data.test:
        alone = _with_pushes(name, known.residual_of(k, done.left), [], done)
        if alone is done:
            continue
        left = [*done.left]
        left[k] = left[k] - data.response(k, alone.acting)
        part = float(np.sum(done.left[k] ** 2) / np.sum((data.values[k] - data.level) ** 2))
        causes = [c.model_copy(update={"share": round(min(part * c.share, 1.0), 4)}) for c in alone.causes]
        done = replace(done, causes=(*done.causes, *causes), acting=(*done.acting, *alone.acting), left=left)
    return done


def _push(name: str, window: Window, rows: ChannelData) -> AxisCause:
    """A force in a window of a run."""
    run, time = rows.runs[window.run], rows.moves[window.run].time
    module = shelf.load("effects", "disturbance")
    own = next(p for p in module.PARAMETERS if p.name == ("force_Nmm" if run.revolute else "force_N"))
    step = _step([rows.moves[window.run]])
    shape, known = {}, {}
    for key, row in (("from_s", window.first), ("to_s", window.last)):
        at = min(row, len(time) - 1)
        lost = 0.5 * max(float(time[at] - time[max(at - 1, 0)]) - step, 0.0)  # rows before it may be missing
        shape[key], known[key] = run.started + float(time[at]) - lost, lost + 2.0 * step
    return AxisCause(
        effect="disturbance", module=module, target=name, parameters=(own,), shape=shape, ways=float(len(time)),
        run=run.name, known=known,
    )  # fmt: skip


def _tell(found: AxisFindings, rows: ChannelData, done: ChannelFit) -> None:
    """Sizes that every axis has, for the reader, in the units of the axis, where the rows determine them."""
    if not np.isfinite(done.covariance).all():
        return
    lever = lever_mm(rows.hinge)
    if rows.channel == "following":
        found.details["following"] = {"acceleration_us2": done.combined({"acceleration": [-1e6]})}
        return
    if rows.channel == "behind":
        found.details["second_encoder"] = {"delay_ms": done.combined({"delay": [-1e3]})}
        if "compliance" in done.sizes:
            key = "compliance_rad_per_Nmm" if rows.hinge else "compliance_mm_per_N"
            found.details["second_encoder"][key] = done.combined({"compliance": [lever**-2]})
        return
    if not rows.hinge:
        found.details["force"] = {
            "mass_kg": done.combined({"acceleration": [1e3]}), "constant_N": done.combined({"offset": [1.0]})
        }  # fmt: skip
        return
    parts = {kind: np.concatenate([rows.inertia[k][kind] for k in rows.train]) for kind in rows.inertia[0]}
    every = {kind: np.concatenate([rows.healthy[k][kind] for k in rows.train]) for kind in parts}
    weight = np.sum([(every[kind] - parts[kind]) @ done.sizes[kind] for kind in parts], axis=0)
    speeding = parts["acceleration"][:, 0]  # its own: by which the bodies' inertia is judged
    by_own = {
        kind: lever**2 * (speeding @ each) / max(float(speeding @ speeding), 1e-300) for kind, each in parts.items()
    }
    found.details["force"] = {
        "inertia_Nmms2_per_rad": done.combined(by_own),
        "constant_Nmm": done.combined({"offset": [lever]}),
        "weight_Nmm": round(lever * float(np.std(weight)), 3),
    }


def _channel(rows: ChannelData, done: ChannelFit, sure: Sequence[Bools]) -> AxisChannel:
    """Residuals of the fitted runs, and of those that are judged only, against the floor; sure (n,) per run: rows that count."""
    moves, values = rows.moves, rows.values
    constant = done.sizes["offset"][0] if rows.channel == "force" else 0.0
    pushing = [each for each in done.acting if each[0].run is not None]
    pushed = [rows.response(k, pushing) for k in range(len(values))]
    # noise is as large as it is seen to be at most
    floors = [(rows.noise(k), np.maximum(np.abs(done.left[k]) / rows.floor, 1.0)) for k in rows.train]
    spread = float(np.sqrt(np.mean(np.concatenate([np.minimum(*each) for each in floors]) ** 2)))
    order = [*rows.train, *rows.test]
    runs = [
        ChannelRun(
            name=rows.runs[k].name, number=k, fitted=k in rows.train, move=moves[k], whole=rows.whole[k],
            gap=values[k] - constant - (0.0 if k in rows.train else pushed[k]), left=done.left[k],
        ).of(sure[k])
        for k in order
    ]  # fmt: skip
    left = [done.left[k] for k in order]
    if rows.channel == "force":  # beside what laws of friction and inertia are known to
        rise = shelf.load("effects", "disturbance").RISE_S
        own = [
            np.hypot(
                not_known(values[k] - done.left[k] - constant),
                rows.friction_unknown(k, done.sizes, rows.response(k, done.acting)),
            )
            for k in order
        ]
        known = [np.hypot(each, rising(pushed[k], moves[k].time, rise)) for k, each in zip(order, own, strict=True)]
        left = [each / np.hypot(1.0, by / rows.floor) for each, by in zip(left, known, strict=True)]
    left = [(each / rows.noise(k))[sure[k]] for k, each in zip(order, left, strict=True)]
    gate = judge(left, [r.move.time for r in runs], rows.floor, [r.name for r in runs])
    return AxisChannel(runs=runs, floor=rows.floor * spread, stated=rows.stated, columns=done.columns, gate=gate)
