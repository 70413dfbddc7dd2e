"""Draws an experiment from its seed: machine, runs, what is wrong and how much, what is measured and how badly."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tests.validation.parallel import unmodelled
from tests.validation.parallel.machine import Machine
from tests.validation.parallel.motion import Track, track
from tests.validation.parallel.plant import COMMON, LIBRARY, Deviation, at_rows, simulate
from tests.validation.recordings import recording

KINDS = {"null": 0.2, "single": 0.3, "pair": 0.15, "imperfect": 0.15, "unknown": 0.2}
CHANNELS = ("no_forces", "no_lines", "no_cmd", "no_encoders", "tip", "tip_line")
MESSES = ("heavy_tails", "outliers", "drift", "coarse", "clock_rate", "line_shift", "gaps", "late_start", "idle_kept")
PITCHES = (4.0, 5.0, 8.0, 10.0, 16.0, 20.0)
UNIT = {  # a size of the first parameter from which to scale
    "servo_lag": 0.5, "backlash": 0.01, "friction": 30.0, "joint_offset": 0.01, "screw_pitch": 50.0,
    "screw_cyclic": 0.01, "thermal_growth": 1e-3, "drive_stiffness": 0.93, "link_stiffness": 0.95,
    "chain_error": 0.01, "link_length": 0.01, "gravity": 5.0, "cutting_force": 1.05, "tool_length": 0.01,
    "tool_deflection": 5e-5, "tool_wear": 0.05, "workpiece_frame": 1.0, "time_sync": 5e-4,
}  # fmt: skip
FIRST = {
    "servo_lag": "time_constant_ms", "backlash": "width_mm", "friction": "force_N", "joint_offset": "offset_mm",
    "screw_pitch": "error_ppm", "screw_cyclic": "amplitude_mm", "thermal_growth": "growth_mm_per_K",
    "drive_stiffness": "factor", "link_stiffness": "factor", "chain_error": "roll_deg", "link_length": "length_mm",
    "gravity": "weight_N", "cutting_force": "factor", "tool_length": "length_mm",
    "tool_deflection": "compliance_mm_per_N", "tool_wear": "growth_per_min", "time_sync": "offset_s",
}  # fmt: skip
SPRINGS = ("drive_stiffness", "link_stiffness")
POSITIVE = ("servo_lag", "backlash", "friction", "screw_cyclic", "gravity", "tool_deflection", "tool_wear")
LARGEST = {"tool_wear": 3.0, "friction": 500.0, "gravity": 400.0, "servo_lag": 8.0, "tool_deflection": 5e-3}


class Impossible(Exception):
    """This draw cannot have the size it should."""


@dataclass
class Scenario:
    """All that is true of one experiment."""

    seed: int
    kind: str
    machine: Machine
    channels: str
    mess: str | None
    sensors: dict
    tracks: list[Track]
    rows: list[np.ndarray]
    warming: dict
    noise_mm: float = 0.0
    causes: list[Deviation] = field(default_factory=list)
    sizes: list[dict] = field(default_factory=list)
    small: list[Deviation] = field(default_factory=list)
    small_mm: float = 0.0
    fault: unmodelled.Strange | None = None
    scatter: np.ndarray | None = None
    ripple: dict | None = None


def rms(values: np.ndarray) -> float:
    """Root mean square of the 3-D length."""
    return float(np.sqrt((values**2).sum(1).mean()))


def runs(rng: np.random.Generator, machine: Machine, warming: dict) -> list[Track]:
    """3 to 6 runs on different recordings, most with circles, a quarter in the air, minutes apart."""
    circles = ["circles-exact", "circles-blended"]
    others = [name for name in recording.names() if name not in circles]
    count = min(int(rng.integers(3, 7)), len(others))
    chosen = list(rng.permutation(others)[:count])
    if rng.random() < 0.75:
        chosen[0] = str(rng.choice(circles))
    rng.shuffle(chosen)
    air = rng.random(count) < 0.25
    air[rng.integers(0, count)] = False
    tracks, clock, minutes = [], float(np.round(rng.uniform(0, 300))), 0.0
    for name, idle in zip(chosen, air, strict=True):
        one = track(machine, str(name), not idle, clock, minutes, warming)
        minutes = one.minutes[-1]
        clock = float(np.round(clock + one.t[-1] + rng.uniform(60, 600)))
        tracks.append(one)
    return tracks


def times(rng: np.random.Generator, tracks: list[Track], keep_idle: bool) -> list[np.ndarray]:
    """Times of the rows (s, whole milliseconds), idle rows and rapids only if kept."""
    dense = rng.random() < 0.2
    rate = float(np.exp(rng.uniform(np.log(20), np.log(200)))) if dense else 0.0
    out = []
    for run in tracks:
        kept = np.ones(len(run.t), bool) if keep_idle else run.feed
        ms = round(1000 / rate) if dense else max(1, int(kept.sum() / rng.integers(200, 501)))
        index = np.arange(int(rng.integers(0, ms)), len(run.t) - 8, ms)
        out.append(run.t[index[kept[index]]])
    return out


def sample(tracks: list[Track], rows: list[np.ndarray], wanted: int) -> list[np.ndarray]:
    """A thinned set of the rows that count: on lines that cut or cut air."""
    fed = [t[run.fed[np.rint(t * 1000).astype(int)]] for run, t in zip(tracks, rows, strict=True)]
    every = max(1, sum(map(len, fed)) // wanted)
    return [t[::every] for t in fed]


def deviation(rng: np.random.Generator, effect: str, target: str | None, size: float, warming: dict) -> Deviation:
    """The effect with drawn side parameters; size multiplies the unit (for factors: the change of compliance)."""
    if effect == "workpiece_frame":
        way = rng.normal(size=4) * [0.01, 0.01, 0.01, 0.02]
        names = ("shift_x_mm", "shift_y_mm", "shift_z_mm", "rotation_deg")
        return Deviation(effect, target, {name: float(v * size) for name, v in zip(names, way, strict=True)})
    parameters = {FIRST[effect]: UNIT[effect] * size}
    if effect == "friction":
        parameters["presliding_mm"] = float(np.exp(rng.uniform(np.log(0.002), np.log(0.02))))
    if effect == "screw_cyclic":
        pitch = rng.choice(PITCHES) if rng.random() < 0.7 else rng.uniform(4, 20)
        parameters |= {"pitch_mm": float(pitch), "phase_rad": float(rng.uniform(0, 2 * np.pi))}
    if effect == "thermal_growth":
        parameters["warm_up_s"] = warming["warm_up_s"]
    return scaled(Deviation(effect, target, parameters | {FIRST[effect]: UNIT[effect]}), size)


def scaled(one: Deviation, by: float) -> Deviation:
    """The same with a tip change `by` times as large, to first order."""
    p = dict(one.parameters)
    if one.effect == "workpiece_frame":
        return Deviation(one.effect, one.target, {name: v * by for name, v in p.items()})
    name = FIRST[one.effect]
    if one.effect in SPRINGS:
        p[name] = 1 / max(1 + by * (1 / p[name] - 1), 1e-3)
    elif one.effect == "cutting_force":
        p[name] = 1 + by * (p[name] - 1)
    else:
        p[name] = p[name] * by
    return Deviation(one.effect, one.target, p)


def possible(one: Deviation) -> bool:
    """Whether a machine could have it."""
    value = one.parameters.get(FIRST.get(one.effect, ""), 0.0)
    if one.effect in SPRINGS or one.effect == "cutting_force":
        return 0.35 < value < 2.5
    return abs(value) < LARGEST.get(one.effect, np.inf)


class Draw:
    """Tools to size deviations of one experiment against its noise."""

    def __init__(self, rng: np.random.Generator, scenario: Scenario) -> None:
        self.rng, self.s = rng, scenario
        self.rows = sample(scenario.tracks, scenario.rows, 180)
        self.many = sample(scenario.tracks, scenario.rows, 600)
        self.base, self.base_many = self.see([], self.rows), self.see([], self.many)

    def see(self, deviations, rows, **more) -> np.ndarray:
        return simulate(self.s.machine, self.s.tracks, rows, deviations, **more).tip

    def change(self, deviations, **more) -> np.ndarray:
        """Tip change (n, 3) mm on the thinned rows."""
        return self.see(deviations, self.rows, **more) - self.base

    def change_many(self, deviations, **more) -> np.ndarray:
        return self.see(deviations, self.many, **more) - self.base_many

    def names(self) -> list[tuple[str, str | None]]:
        """Every effect with every target."""
        out: list[tuple[str, str | None]] = []
        for effect, split in LIBRARY.items():
            out += [(effect, drive) for drive in self.s.machine.drives] if split else [(effect, None)]
        return out

    def sized(self, effect: str, target: str | None, ratio: float) -> Deviation:
        """The effect so large that the tip changes by ratio x noise, rms; of either sign where that makes sense."""
        one = deviation(self.rng, effect, target, 1.0, self.s.warming)
        if effect not in POSITIVE and self.rng.random() < 0.5:
            one = scaled(one, -1.0)
        for _ in range(3):
            got = rms(self.change([one])) / self.s.noise_mm
            if got < 1e-6:
                raise Impossible(effect)
            one = scaled(one, float(np.clip(ratio / got, 1e-4, 1e4)))
            if not possible(one):
                raise Impossible(effect)
            if abs(ratio / got - 1) < 0.05:
                break
        return one


def small_errors(draw: Draw, without: set[tuple[str, str | None]]) -> tuple[list[Deviation], float]:
    """Small errors of everything else, each 0.03 to 0.25 of the noise and together below half of it."""
    rng, noise = draw.rng, draw.s.noise_mm
    left = [n for n in draw.names() if n not in without and (n[0], None) not in without]
    parts = []
    for effect, target in left:
        if effect == "thermal_growth" and draw.s.warming["rise_K"] < 0.5:
            continue
        one = deviation(rng, effect, target, 1.0, draw.s.warming)
        if effect not in POSITIVE and rng.random() < 0.5:
            one = scaled(one, -1.0)
        got = rms(draw.change([one])) / noise
        if got < 1e-6:
            continue
        ratio = float(np.exp(rng.uniform(np.log(0.03), np.log(0.25))))
        one = scaled(one, ratio / got)
        if effect in ("backlash", "friction"):  # no straight lines near zero
            again = rms(draw.change([one])) / noise
            one = scaled(one, float(np.clip(ratio / max(again, 1e-9), 0.3, 3)))
        parts.append((one, ratio))
    for _ in range(6):
        together = rms(draw.change_many([one for one, _ in parts]))
        if together < 0.48 * noise:
            break
        part = 0.45 * noise / together
        shrunk = [(one, max(part, 0.031 / ratio) if ratio > 0.031 else 1.0, ratio) for one, ratio in parts]
        parts = [(scaled(one, by), ratio * by) for one, by, ratio in shrunk]
    else:
        raise Impossible("small")
    return [one for one, _ in parts], together


def left_over(draw: Draw, change: np.ndarray) -> float:
    """Rms (mm) of the residual of a tip change on the thinned rows after a least-squares fit of all library effects.

    Also in the fit, beyond the effects drawn here: squareness, linear axis errors, and screws of many pitches.
    """
    s, columns = draw.s, []
    unit = np.random.default_rng(0)
    for effect, target in draw.names():
        if effect in ("screw_cyclic", "workpiece_frame"):
            continue
        columns.append(draw.change([deviation(unit, effect, target, 1.0, s.warming)]))
    place = np.concatenate([at_rows(run.tip, t) for run, t in zip(s.tracks, draw.rows, strict=True)])
    rho = np.concatenate([at_rows(run.rho, t) for run, t in zip(s.tracks, draw.rows, strict=True)])
    for axis in range(3):
        for shape in (np.ones(len(place)), *place.T):
            column = np.zeros_like(place)
            column[:, axis] = shape
            columns.append(column)
    for drive, name in enumerate(s.machine.drives):
        per_mm = draw.change([Deviation("joint_offset", name, {"offset_mm": 0.01})]) / 0.01
        for pitch in (*PITCHES, 2.5, 6.0, 12.0, 25.0):
            for wave in (np.sin, np.cos):
                columns.append(per_mm * wave(2 * np.pi * rho[:, drive] / pitch)[:, None])
    if s.channels.startswith("tip"):  # time along the path is free there: only what is across it counts
        along = np.concatenate([at_rows(np.gradient(run.tip, axis=0), t) for run, t in
                                zip(s.tracks, draw.rows, strict=True)])  # fmt: skip
        along /= np.maximum(np.linalg.norm(along, axis=1), 1e-9)[:, None]
        columns = [c - (c * along).sum(1)[:, None] * along for c in columns]
        change = change - (change * along).sum(1)[:, None] * along
    basis = np.array([column.ravel() / max(np.linalg.norm(column), 1e-12) for column in columns]).T
    rest = change.ravel() - basis @ np.linalg.lstsq(basis, change.ravel(), rcond=1e-10)[0]
    return rms(rest.reshape(-1, 3))


def choose(rng: np.random.Generator, draw: Draw, taken: list[str]) -> tuple[str, str | None]:
    """An effect that the channels can show at all, and its target."""
    barred = set(taken)
    if draw.s.channels == "no_cmd" or draw.s.channels.startswith("tip"):
        barred.add("servo_lag")  # what moved is then what the encoders say, or the tip's own time
    if draw.s.channels.startswith("tip"):
        barred.add("time_sync")
    effect = str(rng.choice([name for name in LIBRARY if name not in barred]))
    if not LIBRARY[effect] or (effect in COMMON and rng.random() < 0.5):
        return effect, None
    return effect, str(rng.choice(draw.s.machine.drives))


def cause_entry(draw: Draw, one: Deviation) -> dict:
    """The truth's words for a cause of the library."""
    size = rms(draw.change_many([one]))
    return {"effect": one.effect, "target": one.target, "parameters": one.parameters, "strange": False,
            "um": size * 1e3, "ratio": size / draw.s.noise_mm}  # fmt: skip


def fill(rng: np.random.Generator, s: Scenario) -> None:
    """Draws the faults, by the scenario's kind."""
    draw, without = Draw(rng, s), set()
    if s.kind in ("single", "pair"):
        for _ in range(2 if s.kind == "pair" else 1):
            for _ in range(30):
                effect, target = choose(rng, draw, [one.effect for one in s.causes])
                try:
                    one = draw.sized(effect, target, float(np.exp(rng.uniform(np.log(3.1), np.log(11.8)))))
                except Impossible:
                    continue
                entry = cause_entry(draw, one)
                if 3 <= entry["ratio"] <= 12:
                    break
            else:
                raise Impossible("no cause")
            s.causes.append(one)
            s.sizes.append(entry)
            without.add((effect, target))
            if effect in COMMON and target is None:
                without |= {(effect, drive) for drive in s.machine.drives}
    if s.kind == "imperfect":
        without |= {(e, d) for e, d in draw.names() if e in (*SPRINGS, "cutting_force")}

        def off(low: float, high: float) -> dict:
            return {"factor": 1 + float(rng.choice([-1, 1]) * rng.uniform(low, high))}

        springs = [Deviation("drive_stiffness", drive, off(0.02, 0.08)) for drive in s.machine.drives]
        springs.append(Deviation("link_stiffness", None, off(0.02, 0.08)))
        springs.append(Deviation("cutting_force", None, off(0.03, 0.1)))
        s.causes = springs
        s.scatter = 1 + 0.003 * rng.normal(size=(2, len(s.machine.drives)))
        s.ripple = {"share": float(rng.uniform(0.03, 0.12)), "teeth": int(rng.integers(2, 5)),
                    "runout": float(rng.uniform(0, 0.3)), "mode_Hz": float(rng.uniform(25, 50))}  # fmt: skip
        entries = [cause_entry(draw, one) for one in springs]
        s.sizes = [entry for entry in entries if entry["ratio"] > 0.3]
    if s.kind == "unknown":
        spans = [(run.started_s, run.started_s + run.t[-1]) for run in s.tracks]
        seen = s.channels in ("all", "no_forces", "no_lines")
        for _ in range(25):
            fault = unmodelled.draw(rng, len(s.machine.drives), spans, seen)
            fault = fault.scaled(0.01 if "force" not in fault.at(s.machine, s.tracks[0]) else 0.05)
            wanted = float(np.exp(rng.uniform(np.log(4.1), np.log(9.8)))) * s.noise_mm
            for _ in range(2):
                got = rms(draw.change([], strange=fault))
                fault = fault.scaled(fault.size * wanted / got) if got > 1e-9 else fault
            change = draw.change([], strange=fault)
            left = left_over(draw, change) if rms(change) > 0.9 * wanted else 0.0
            share = fault.size if fault.name in ("grain_direction", "built_up_edge") else 0.0
            if left > 1.15 * s.noise_mm and share < 0.8:
                break
        else:
            raise Impossible("no fault")
        s.fault = fault
        size = rms(draw.change_many([], strange=fault))
        s.sizes = [{"effect": fault.name, "target": seat(fault, s.machine),
                    "parameters": {"size": fault.size, **fault.constants}, "strange": True,
                    "stage": unmodelled.STAGES[fault.name], "um": size * 1e3, "ratio": size / s.noise_mm,
                    "left_ratio": left / s.noise_mm}]  # fmt: skip
    s.small, s.small_mm = small_errors(draw, without)


def seat(fault: unmodelled.Strange, machine: Machine) -> str | None:
    """The drive that a fault sits at, or None."""
    here = unmodelled.STAGES[fault.name] in ("control", "drive") or fault.name in ("guide_waviness", "loose_foot")
    return machine.drives[fault.drive] if here else None
