"""Programs of straight lines, corrected ones too, as a control would drive them: the machine under trial cuts them again."""

from __future__ import annotations

import re

import numpy as np

from tests.validation.recorded.plant import Run, State
from tests.validation.recordings.recording import STEP_S, Recording

RAPID_MM_PER_S = 100.0


def driven(program: str) -> Recording:
    """Every line at its feed, without stops and ramps; absolute millimetres, G0 and G1 alone."""
    at, feed, motion = np.zeros(3), 600.0, 0
    tips, lines, kinds = [at[None]], [np.zeros(1, int)], [np.zeros(1, int)]
    for number, text in enumerate(program.splitlines(), start=1):
        words = re.findall(r"([A-Z])(-?[\d.]+)", re.sub(r"\(.*?\)|;.*", "", text))
        goal = at.copy()
        for letter, digits in words:
            if letter == "G" and float(digits) in (0, 1):
                motion = int(float(digits))
            assert not (letter == "G" and float(digits) in (2, 3)), "arcs are not driven"
            feed = float(digits) if letter == "F" else feed
            if letter in "XYZ":
                goal["XYZ".index(letter)] = float(digits)
        far = float(np.linalg.norm(goal - at))
        if far > 0:
            speed = feed / 60 if motion else RAPID_MM_PER_S
            n = max(int(np.ceil(far / (speed * STEP_S))), 1)
            tips.append(at + (goal - at) * (np.arange(1, n + 1) / n)[:, None])
            lines.append(np.full(n, number))
            kinds.append(np.full(n, 2 if motion else 1))
        at = goal
    tip = np.concatenate(tips)
    t = np.arange(len(tip)) * STEP_S
    return Recording(f"recut {hash(program)}", program, t, tip, np.concatenate(lines), np.concatenate(kinds))


def misses_um(state: State, run: Run, programmed: Recording) -> float:
    """How far (rms, um) the tip is from the programmed path where the tool feeds in its plane."""
    cut = programmed.tip[(programmed.kind == 2)][::5]
    k = np.clip((state.t / STEP_S).astype(int), 0, len(run.recording.kind) - 1)
    tip = state.tip[run.recording.kind[k] == 2]
    tip = tip[tip[:, 2] < 0.5]
    near = ((tip[:, None] - cut[None]) ** 2).sum(2).argmin(1)
    near = np.clip(near, 1, len(cut) - 2)
    way = cut[near + 1] - cut[near - 1]
    way /= np.maximum(np.linalg.norm(way, axis=1), 1e-12)[:, None]
    off = tip - cut[near]
    off -= (off * way).sum(1, keepdims=True) * way
    return 1e3 * float(np.sqrt((off**2).sum(1).mean()))
