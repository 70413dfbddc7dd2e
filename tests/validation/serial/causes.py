"""What can be off: the contract's effects with their sizes, faults that no effect describes, and what remains of those.

Units mm, N, s, rad. `amount` is the one number of an effect that is scaled until the tip moves as far as it should.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tests.validation.serial import drives
from tests.validation.serial.plant import Off, Plant, apply, axis_speed, pick, speed


@dataclass
class Item:
    """One effect on one target: its parameters at an amount, the amount it begins with, and how far it may go."""

    effect: str
    target: str | None
    parameters: Callable[[float], dict]
    unit: float
    low: float
    high: float
    signed: bool

    @property
    def key(self) -> tuple:
        return self.effect, self.target

    def put(self, plant: Plant, off: Off, amount: float) -> Off:
        return apply(plant.machine, off, self.effect, self.target, self.parameters(amount))


def library(plant: Plant, rng: np.random.Generator) -> list[Item]:
    """All effects of the contract that have a clear meaning on this machine, with their side parameters drawn."""
    machine, rotary = plant.machine, plant.machine.rotary
    u, uf = ("rad", "Nmm") if rotary else ("mm", "N")
    inch = 1e-3 if rotary else 1.0  # a carriage's mm, as an angle on an arm of a metre
    items: list[Item] = []

    def add(effect, target, parameters, unit, low, high, signed):
        items.append(Item(effect, target, parameters, unit, low, high, signed))

    for a, name in enumerate(machine.names):
        add("servo_lag", name, lambda x: {"time_constant_ms": x}, 0.1, 0.001, 12, False)
        add("backlash", name, lambda x: {f"width_{u}": x}, 0.01 * inch, 1e-5 * inch, 0.3 * inch, False)
        reach = float(rng.uniform(2e-3, 15e-3)) * inch
        add(
            "friction",
            name,
            lambda x, reach=reach: {f"force_{uf}": x, f"presliding_{u}": reach},
            machine.stiffness[a] * 0.005 * inch,
            0,
            machine.stiffness[a] * 0.06 * inch,
            False,
        )
        add("joint_offset", name, lambda x: {f"offset_{u}": x}, 0.01 * inch, 0, 0.5 * inch, True)
        add("drive_stiffness", name, lambda x: {"factor": 1 + x}, 0.02, -0.6, 1.5, True)
        if rotary:
            continue
        add("screw_pitch", name, lambda x: {"error_ppm": x}, 100.0, 0, 2000, True)
        pitch, phase = float(rng.choice([4.0, 5.0, 8.0, 10.0, 16.0])), float(rng.uniform(0, 2 * np.pi))
        add(
            "screw_cyclic",
            name,
            lambda x, pitch=pitch, phase=phase: {"amplitude_mm": x, "pitch_mm": pitch, "phase_rad": phase},
            0.005,
            0,
            0.2,
            False,
        )
        warm = plant.warmth.seconds
        add(
            "thermal_growth",
            name,
            lambda x, warm=warm: {"growth_mm_per_K": x, "warm_up_s": warm},
            1e-3,
            0,
            0.02,
            True,
        )
    add("gravity", None, lambda x: {"weight_N": x}, 20.0, 0, 400, False)
    add("cutting_force", None, lambda x: {"factor": 1 + x}, 0.05, -0.6, 1.2, True)
    if machine.links:
        add("link_stiffness", None, lambda x: {"factor": 1 + x}, 0.02, -0.6, 1.5, True)
    add("tool_length", None, lambda x: {"length_mm": x}, 0.01, 0, 0.5, True)
    add("tool_deflection", None, lambda x: {"compliance_mm_per_N": x}, 1e-5, 0, 3e-3, False)
    add("tool_wear", None, lambda x: {"growth_per_min": x}, 0.1, 0, 2.0, False)
    way, spin = rng.normal(size=3), float(rng.uniform(-1, 1))
    way = way / np.linalg.norm(way)
    add(
        "workpiece_frame",
        None,
        lambda x: {
            "shift_x_mm": x * way[0],
            "shift_y_mm": x * way[1],
            "shift_z_mm": x * way[2],
            "rotation_deg": x * spin * 3,
        },
        0.01,
        0,
        0.5,
        True,
    )
    add("time_sync", None, lambda x: {"offset_s": x}, 1e-4, 0, 0.02, True)
    for pair in () if rotary else ("xy", "xz", "yz"):
        add("squareness", pair, lambda x: {"angle_mrad": x}, 0.1, 0, 20, True)
    return items


def common(plant: Plant) -> list[Item]:
    """Effects with one value for all actuators."""
    warm = plant.warmth.seconds
    items = [Item("servo_lag", None, lambda x: {"time_constant_ms": x}, 0.1, 0.001, 12, False)]
    if not plant.machine.rotary:
        items.append(
            Item("thermal_growth", None, lambda x: {"growth_mm_per_K": x, "warm_up_s": warm}, 1e-3, 0, 0.02, True)
        )
    return items


def disturbed(plant: Plant, rng: np.random.Generator) -> Item:
    """A carriage that is shifted for some seconds of one run."""
    number, name = int(rng.integers(len(plant.runs))), str(rng.choice(plant.machine.names))
    run = plant.runs[number]
    busy = run.t[run.fed]
    width = float(rng.uniform(0.15, 0.4)) * (busy[-1] - busy[0])
    t0 = float(rng.uniform(busy[0], busy[-1] - width))
    u = "rad" if plant.machine.rotary else "mm"
    side = {"run_index": number, "run": f"run-{number + 1}", "t0_s": t0, "t1_s": t0 + width}
    scale = 1e-3 if plant.machine.rotary else 1.0
    return Item("disturbance", name, lambda x: side | {f"shift_{u}": x}, 0.02 * scale, 0, 0.5 * scale, True)


def rms(values: np.ndarray) -> float:
    """3-D rms in um of (n, 3) mm."""
    return 1e3 * float(np.sqrt((values**2).sum(1).mean()))


class Local:
    """Sensitivities of the tip at the chosen rows, carriage shifts by their share in the tip, others by difference."""

    def __init__(self, plant: Plant):
        self.plant = plant
        self.off = Off.nothing(plant.machine)
        self.base = plant.tips(self.off)
        self.shares = []
        step = 1e-5 if plant.machine.rotary else 1e-2
        for a in range(len(plant.machine.names)):
            off = self.off.copy()
            off.joint_offset[a] = step
            self.shares.append((plant.tips(off) - self.base) / step)

    def carriage(self, a: int, values: Callable) -> np.ndarray:
        """Tip change (n, 3) for a carriage shift that values(run) gives at 1 kHz."""
        rows = [pick(run.t, values(run)[:, None], run.rows)[:, 0] for run in self.plant.runs]
        return self.shares[a] * np.concatenate(rows)[:, None]

    def of(self, item: Item, amount: float | None = None) -> np.ndarray:
        """Tip change (n, 3) in mm by an effect at its unit, or at an amount."""
        return self.plant.tips(item.put(self.plant, self.off, item.unit if amount is None else amount)) - self.base

    def quick(self, item: Item) -> np.ndarray:
        """Tip change by an effect at its unit; effects of one carriage are computed by its column."""
        machine, unit = self.plant.machine, item.unit
        if item.target not in machine.names:
            return self.of(item)
        a = machine.names.index(item.target)
        p = item.parameters(unit)

        def column(run):
            return np.ascontiguousarray(run.q[:, a])

        if item.effect == "servo_lag":
            return self.carriage(a, lambda run: -1e-3 * unit * axis_speed(run, a))
        if item.effect == "backlash":
            return self.carriage(a, lambda run: drives.play(column(run), unit))
        if item.effect == "friction":
            reach = next(v for k, v in p.items() if k.startswith("presliding"))
            slow = 1e-3 if machine.rotary else 1.0
            return self.carriage(
                a, lambda run: -unit / machine.stiffness[a] * drives.bristles(column(run), reach, slow)
            )
        if item.effect == "joint_offset":
            return self.shares[a] * unit
        if item.effect == "screw_pitch":
            return self.carriage(a, lambda run: unit * 1e-6 * (run.q[:, a] - machine.home[a]))
        if item.effect == "screw_cyclic":
            return self.carriage(a, lambda run: unit * np.sin(2 * np.pi * run.q[:, a] / p["pitch_mm"] + p["phase_rad"]))
        if item.effect == "thermal_growth":
            return self.carriage(a, lambda run: unit * (self.plant.warmth.at(run.started_s + run.t) - 20))
        return self.of(item)

    def span(self, items: list[Item], rng: np.random.Generator, extra_pitch: float | None = None) -> np.ndarray:
        """Everything the library could fit, as columns (3 n, k): also other pitches, tables over axes, warming curves."""
        machine = self.plant.machine
        columns = [self.quick(item) for item in items if item.effect != "workpiece_frame"]
        columns = [column for column in columns if rms(column) > 1e-3]  # what moves nothing can explain nothing
        place = self.base
        one, zero = np.ones(len(place)), np.zeros(len(place))
        for k in range(3):
            columns.append(np.column_stack([one if k == j else zero for j in range(3)]))
        columns.append(np.column_stack([-place[:, 1], place[:, 0], zero]))
        slow = 1e-3 if machine.rotary else 1.0
        for a in range(len(machine.names)):
            if rms(self.shares[a]) < (1e3 if machine.rotary else 1):
                continue  # a hinge through the tip
            for reach in (1e-3, 5e-3, 3e-2):
                columns.append(
                    self.carriage(a, lambda run, a=a, r=reach * slow: drives.bristles(run.q[:, a].copy(), r, slow))
                )
            for seconds in (300, 1200, 3600):
                columns.append(self.carriage(a, lambda run, s=seconds: 1 - np.exp(-(run.started_s + run.t) / s)))
            pitches = [4.0, 5.0, 10.0] if not machine.rotary else []
            for pitch in pitches + ([extra_pitch] if extra_pitch else []):
                for phase in (0, np.pi / 2):
                    columns.append(
                        self.carriage(a, lambda run, a=a, w=2 * np.pi / pitch, f=phase: np.sin(w * run.q[:, a] + f))
                    )
        # Errors of the axes: along and about each, as a table of straight pieces over each.
        for axis in range(3):
            values = place[:, axis]
            knots = np.linspace(values.min(), values.max(), 6)
            for node in range(6):
                hat = np.interp(values, knots, np.eye(6)[node])
                for along in range(3):
                    columns.append(np.column_stack([hat if along == j else zero for j in range(3)]))
                for about in range(3):
                    way = np.eye(3)[about]
                    columns.append(np.cross(way, place) * hat[:, None] * 1e-2)
        matrix = np.column_stack([c.ravel() for c in columns])
        size = np.linalg.norm(matrix, axis=0)
        return matrix[:, size > 0] / size[size > 0]


def remains(span: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Residual of a tip change (n, 3) after a least-squares fit of the span.

    Columns have the length one; sums of them that all but cancel would need errors of millimetres, and are left out.
    """
    fit, *_ = np.linalg.lstsq(span, change.ravel(), rcond=3e-3)
    return (change.ravel() - span @ fit).reshape(change.shape)


def strange(plant: Plant, local: Local, rng: np.random.Generator) -> dict:
    """A fault that no effect describes, of size one in its own unit; key stage says where it acts."""
    machine = plant.machine
    moving = [a for a in range(len(machine.names)) if np.ptp(np.concatenate([r.q[:, a] for r in plant.runs])) > 1e-4]
    if not machine.rotary:
        moving = [a for a in moving if a < 2]
    a = int(rng.choice(moving))
    name = str(
        rng.choice(
            [
                "ringing",
                "square_lag",
                "one_way_cyclic",
                "self_heating",
                "soft_drive",
                "grain",
                "hard_spot",
                "speed_force",
                "blunt",
                "yaw_play",
                "slip_joint",
                "vibration",
                "beam_cyclic",
                "tracker_twist",
            ]
        )
    )
    small = 1e-3 if machine.rotary else 1.0
    angle = float(rng.uniform(0.3, 1.2)) + float(rng.choice([0, np.pi / 2]))
    diagonal = [float(np.cos(angle)), float(np.sin(angle)), 0.0]
    phase = float(rng.uniform(0, 2 * np.pi))
    s: dict = {"name": name, "axis": a, "size": 1.0}
    if name == "ringing":
        s |= {"stage": "control", "hertz": float(rng.uniform(4, 9)), "damping": float(rng.uniform(0.04, 0.12))}
    elif name == "square_lag":
        s |= {"stage": "control", "size": 1e-5 / small}
    elif name == "one_way_cyclic":
        spread = np.ptp(np.concatenate([r.q[:, a] for r in plant.runs]))
        pitch = float(rng.uniform(6, 14)) if not machine.rotary else float(spread / rng.uniform(4, 9))
        s |= {"stage": "drive", "pitch": pitch, "phase": phase, "turn_over": 0.01 * small, "size": 0.01 * small}
    elif name == "self_heating":
        s |= {"stage": "drive", "seconds": float(rng.uniform(5, 30)), "size": 1e-4}
    elif name == "soft_drive":
        load = -np.concatenate([plant.rows(k, local.off, run.rows).drive[:, a] for k, run in enumerate(plant.runs)])
        s |= {
            "stage": "spring",
            "middle": float(load.mean()),
            "scale": float(0.25 * load.std()) + 1e-6,
            "size": 0.01 * small,
        }
    elif name in ("grain", "hard_spot", "speed_force", "blunt"):
        s |= {"stage": "process", "size": 0.2}
        if name == "grain":
            s |= {"angle": float(rng.uniform(0, np.pi))}
        if name == "hard_spot":
            cut = np.concatenate([run.tip[run.cuts, :2] for run in plant.runs])
            s |= {"centre": cut[rng.integers(len(cut))].tolist(), "radius": float(rng.uniform(6, 15))}
    else:
        s |= {"stage": "tip", "size": 0.01}
        if name == "yaw_play":
            axis = int(rng.integers(2))
            s |= {"axis": axis, "other": 1 - axis, "turn_over": 0.02, "middle": 0.0, "size": 1e-3}
        elif name == "slip_joint":
            force = np.concatenate([np.linalg.norm(r.triple[r.cuts], axis=1) for r in plant.runs])
            s |= {"yield_N": float(force.mean() * rng.uniform(0.3, 0.6)), "size": 1e-4}
        elif name == "vibration":
            s |= {"hertz": float(rng.uniform(0.4, 2.0)), "phase": phase, "direction": diagonal}
        elif name == "beam_cyclic":
            s |= {"period": float(rng.uniform(6, 14)), "phase": phase, "direction": diagonal}
        else:
            middle = local.base.mean(0)
            s |= {"seconds": float(rng.uniform(4, 12)), "phase": phase, "size": 1e-3}
            s |= {"x": float(middle[0]), "y": float(middle[1])}
    return s


__all__ = ["Item", "Local", "common", "disturbed", "library", "remains", "rms", "speed", "strange"]
