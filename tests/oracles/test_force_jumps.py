"""The cutting force along random programs: every way through camcomp against a cutter and a machine that share nothing with it.

Feed, speed and sense of the spindle change between moves that go straight on, as well as at corners. Truth: forces from a
cutter turned tooth by tooth, loaded poses from the minimum of the energy, both along the moves that the program was made of.
"""

import io
import json
from itertools import pairwise

import numpy as np
import pytest

from camcomp.compensation.long import runs
from camcomp.compensation.long.program import LongProgram
from camcomp.compensation.long.runs import NotInPieces
from camcomp.compensation.program.compensate import compensate
from camcomp.compensation.program.verify import verify
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.control import program_of, setup_of
from camcomp.model.job import Job
from camcomp.model.motion.simulate import simulate
from tests.validation.plants import energy, milling
from tests.validation.plants.legs import orthoglide
from tests.validation.plants.machine import ORIGIN
from tests.validation.plants.motion import SMOOTH, Move, Timeline

AGREED_UM = 0.05
ROLLED, NOMINAL = orthoglide(roll_deg=1.0), orthoglide()
TRIPLE = np.array([80.0, -20.0, -10.0])
TOOL = {"diameter_mm": 6, "teeth": 2, "length_mm": 100}
MECHANISTIC = {
    "model": "mechanistic", "Ktc_N_per_mm2": 631, "Krc_N_per_mm2": 99, "Kac_N_per_mm2": 273, "Kte_N_per_mm": 13,
    "Kre_N_per_mm": 10, "Kae_N_per_mm": 2.8,
}  # fmt: skip
KIENZLE = {"model": "kienzle", "kc11_N_per_mm2": 700, "mc": 0.25, "radial_ratio": 0.4, "axial_ratio": 0.2}
FORCES = {
    "none": {"model": "none"},
    "constant": {"model": "constant", "Fr_N": TRIPLE[0], "Ft_N": TRIPLE[1], "Fz_N": TRIPLE[2]},
    "mechanistic": MECHANISTIC,
    "kienzle": KIENZLE,
    "table": {"model": "table", "file": "forces.csv"},
}
EDGES = {
    "mechanistic": milling.linear(631.0, 99.0, 273.0, (13.0, 10.0, 2.8)),
    "kienzle": milling.power(700.0, 0.25, 0.4, 0.2),
}


class Truth:
    """A random program, its moves, and the motion of the machine along them."""

    def __init__(self, model: str, seed: int, arcs: bool) -> None:
        rng = np.random.default_rng(seed)
        self.model = model
        self.moves: list[Move] = []
        self.triples: list[np.ndarray] = []
        text = ["G21 G90 G17 G94", "M3 S12000", "G0 X20 Y20 Z30"]
        here, heading, feed, speed, sense = np.array([20.0, 20.0, 30.0]), 0.3, 600.0, 12000.0, 1.0
        for k in range(40):
            if rng.random() < 0.15:
                speed, sense = float(rng.choice([8000, 12000])), float(rng.choice([1, -1]))
                text.append(f"M{3 if sense > 0 else 4} S{speed:g}")
            feed = float(rng.choice([400, 600, 1500])) if rng.random() < 0.4 else feed
            turned = arcs and 10 < k < 30 and rng.random() < 0.4
            heading += float(rng.choice([0.0, 0.03, -0.04, 0.7, -0.9]))
            end, centre, sweep = here + 2.5 * np.array([np.cos(heading), np.sin(heading), 0.0]), np.zeros(2), 0.0
            if turned:
                sweep = float(rng.choice([1.2, -0.8]))
                side = 4.0 * np.sign(sweep) * np.array([-np.sin(heading), np.cos(heading)])
                centre = here[:2] + side
                c, s = np.cos(sweep), np.sin(sweep)
                end = np.array([*(centre + np.array([[c, -s], [s, c]]) @ -side), here[2]])
                heading += sweep
            end = np.round(end, 6)
            word = f"G{3 if sweep > 0 else 2}" if turned else "G1"
            beside = "".join(f" {a}{v:.6f}" for a, v in zip("IJ", centre - here[:2], strict=True)) if turned else ""
            text.append(f"{word} X{end[0]:.6f} Y{end[1]:.6f}{beside} F{feed:g}")
            self.moves.append(Move(len(text), True, here, end, np.round(centre, 6), sweep, feed / 60.0))
            self.triples.append(self._triple(feed, speed, sense))
            here = end
        self.text = "\n".join([*text, "G0 Z40", "M30", ""])

    def _triple(self, feed: float, speed: float, sense: float) -> np.ndarray:
        if self.model in EDGES:
            return milling.slot(EDGES[self.model], feed=feed, speed=speed, sense=sense, depth=1.5, teeth=2)
        if self.model == "table":
            return TRIPLE * (1.0 + 0.1 * (len(self.moves) % 3))
        return TRIPLE if self.model == "constant" else np.zeros(3)

    def table(self) -> str:
        """The forces by line, for the model that reads them from a file."""
        rows = [f"{m.line},{f[0]},{f[1]},{f[2]}" for m, f in zip(self.moves, self.triples, strict=True)]
        return "\n".join(["line,Fr_N,Ft_N,Fz_N", *rows])

    def goes_on(self, k: int) -> bool:
        """Whether the force passes from move k to the next without a jump."""
        return self.moves[k].leads_into(self.moves[k + 1]) and bool(np.array_equal(*self.triples[k : k + 2]))

    def force(self, k: int, share: float) -> np.ndarray:
        """N along move k: what the cutter says, and at a bend below 5 degrees that of the direction between both."""
        at = lambda i, u: self.moves[i].at(np.array([u]))[1][0]
        out = _vector(self.triples[k], at(k, share))
        for other, end in ((k - 1, 0.0), (k + 1, 1.0)):
            if 0 <= other < len(self.moves) and self.goes_on(min(k, other)):
                middle = at(k, end) + at(other, 1.0 - end)
                shared = _vector(self.triples[k], middle / np.linalg.norm(middle))
                out = out + (share if end else 1.0 - share) * (shared - _vector(self.triples[k], at(k, end)))
        return out

    def share(self, k: int, tip: np.ndarray) -> float:
        """Share of move k at a point of it."""
        move = self.moves[k]
        if move.sweep == 0.0:
            return float(np.clip(np.linalg.norm(tip - move.start) / move.length, 0.0, 1.0))
        a, b = move.start[:2] - move.centre, tip[:2] - move.centre
        turned = np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b)
        return float(np.clip(turned / move.sweep, 0.0, 1.0))

    def check(self, line: np.ndarray, target: np.ndarray, written: np.ndarray, force: np.ndarray) -> None:
        """Rows of a corrected program: their forces, and where the machine brings the tips of its end points."""
        of = {move.line: k for k, move in enumerate(self.moves)}
        rows = [i for i, number in enumerate(line) if int(number) in of]
        shares = np.array([self.share(of[int(line[i])], target[i]) for i in rows])
        said = np.array([self.force(of[int(line[i])], u) for i, u in zip(rows, shares, strict=True)])
        behind = np.array([i for i, n in enumerate(rows) if int(line[n]) == self.moves[-1].line][-1:])
        said[behind] = 0.0 if self.model != "none" else said[behind]  # the last line leads out of the cut
        assert np.abs(force[rows] - said).max() < 2e-4 * max(1.0, np.abs(said).max())
        ends = (shares < 1e-7) | (shares > 1.0 - 1e-7)
        rho = energy.inverse(NOMINAL, written[rows][ends] + ORIGIN)
        tip = energy.settle(ROLLED, rho, said[ends]).tip - ORIGIN
        assert 1e3 * np.linalg.norm(tip - target[rows][ends], axis=1).max() < AGREED_UM

    def joins(self) -> int:
        """Joining lines: into the cut, out of it, and wherever the force jumps."""
        if self.model == "none":
            return 0
        return 2 + sum(not self.goes_on(k) for k in range(len(self.moves) - 1))


def _vector(triple: np.ndarray, along: np.ndarray) -> np.ndarray:
    return triple[0] * np.array([along[1], -along[0], 0.0]) + triple[1] * along + np.array([0.0, 0.0, triple[2]])


def job_for(truth: Truth, folder) -> Job:
    (folder / "forces.csv").write_text(truth.table())
    process = {"force": FORCES[truth.model], "depth_mm": 1.5}
    extra = {"process": process, "tool": TOOL, "control": {"resolution_mm": 1e-6}}
    (folder / "extra.yaml").write_text(json.dumps(extra))
    return Job(load_config([shipped("config/orthoglide-1deg.yaml"), str(folder / "extra.yaml")]))


@pytest.mark.parametrize("model", FORCES)
@pytest.mark.parametrize("arcs", [False, pytest.param(True, marks=pytest.mark.campaign)])
def test_every_way_sees_the_same_force(tmp_path, monkeypatch, model, arcs):
    monkeypatch.setattr(runs, "PROBE_MOTIONS", 4)
    truth = Truth(model, 7 + arcs, arcs)
    job = job_for(truth, tmp_path)
    program = program_of(truth.text.encode(), "p.nc", job.config)
    short = compensate(program, job, method="newton", tolerance_um=AGREED_UM, version="0")
    rows = short.rows
    assert 1e3 * np.linalg.norm(short.after, axis=1).max() <= AGREED_UM
    if model != "none":
        assert rows.joining.sum() == truth.joins()
    truth.check(short.lines, rows.target, short.written.end, rows.force)

    checked = verify(program_of(short.written.data, "c.nc", job.config), program, job)
    assert checked.joining == rows.joining.sum()
    assert 1e3 * checked.residual.max() < 1.2 * AGREED_UM

    run = simulate(job, program.path, 0.0137)
    here = Timeline(truth.moves).sample(run.time)
    of = {move.line: k for k, move in enumerate(truth.moves)}
    k = [of[int(line)] for line in here["line"]]
    shares = np.array([truth.share(i, tip) for i, tip in zip(k, here["tip"], strict=True)])
    inside = (shares > 1e-6) & (shares < 1.0 - 1e-6)
    force = np.array([truth.force(i, u) for i, u in zip(k, shares, strict=True)])
    tip = energy.settle(ROLLED, energy.inverse(NOMINAL, here["tip"] + ORIGIN), force).tip - ORIGIN
    assert 1e3 * np.linalg.norm(run.reading.tip - tip, axis=1)[inside].max() < AGREED_UM

    batches: list = []
    bulk = LongProgram(
        job=job, name="p.nc", setup=setup_of(job.config), tolerance_um=AGREED_UM, version="0", on_rows=batches.append
    )
    if model == "table":
        with pytest.raises(NotInPieces):
            bulk.run(io.BytesIO(truth.text.encode()), len)
        return
    totals = bulk.run(io.BytesIO(truth.text.encode()), len)
    assert totals.joins == rows.joining.sum()
    assert totals.interpolated.tiles > 0
    every = [np.concatenate([getattr(b, name) for b in batches]) for name in ("line", "target", "written", "force")]
    truth.check(*every)


def test_bends_of_every_kind_are_among_them():
    truth = Truth("mechanistic", 8, True)
    bends = [float(a.at(np.ones(1))[1][0] @ b.at(np.zeros(1))[1][0]) for a, b in pairwise(truth.moves)]
    straight = np.array(bends) > SMOOTH
    jumps = ~np.array([truth.goes_on(k) for k in range(len(bends))])
    assert (straight & jumps).sum() >= 3 and (straight & ~jumps).sum() >= 3 and (~straight).sum() >= 3
    assert {np.sign(each[0]) for each in truth.triples} == {-1.0, 1.0}
    assert {move.sweep != 0.0 for move in truth.moves} == {True, False}
