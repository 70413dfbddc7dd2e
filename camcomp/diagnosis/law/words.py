"""Laws in words: what forms say, and formulas of terms with their coefficients."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from camcomp.diagnosis.law.forms import Form

WORDS = {
    "line": "rises evenly with", "power": "follows a power of", "wave": "repeats over", "bump": "is a bump at one place of",
    "sense": "turns round with the sense of", "drag": "is dragged behind", "reversal": "fades behind reversals of",
    "rate": "goes with", "acceleration": "goes with", "product": "follows the product of", "force": "goes with",
    "force squared": "goes with the square of", "force power": "follows a power of", "force by place": "goes with", "step": "steps at one moment of",
    "while": "acts for a while of", "settling": "settles with", "constant": "is a constant",
}  # fmt: skip


def law_sentence(forms: Sequence[Form]) -> str:
    """The sentence that states the forms of a law."""
    said = [f"{WORDS.get(each.family, 'goes with')} {listed(each.about)}{_place(each)}" for each in forms if each.about]
    return f"What is left {listed(list(dict.fromkeys(said)))}."


def _place(form: Form) -> str:
    """Where a bump stands: between its halves of the height."""
    if form.family != "bump":
        return ""
    centre, width = form.shape
    half = width * float(np.sqrt(np.log(2.0)))  # exp(-u^2)
    return f", from {centre - half:.3g} to {centre + half:.3g}"


def law_sum(pairs: Sequence[tuple[float, str]]) -> str:
    """A formula of terms with their coefficients."""
    out = ""
    for value, text in pairs:
        sign = ("-" if value < 0 else "") if not out else (" - " if value < 0 else " + ")
        size = f"{abs(value):.6g}"
        out += sign + (size if text == "1" else f"{size}*{text}")
    return out


def listed(names: Sequence[str]) -> str:
    """`a, b and c`."""
    return ", ".join(names[:-1]) + " and " + names[-1] if len(names) > 1 else "".join(names)
