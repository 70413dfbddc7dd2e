"""What several commands say in the same words."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from camcomp.compensation.program.result import Summary, Verification

_NO_ACTION = "; nothing to do"


def controller_line(figures: "Summary | Verification") -> str:
    """Tip error and cycle time on the path that the controller drives."""
    mode = figures.control_mode + ("" if figures.control_mode_stated else " (assumed)")
    times, left = figures.cycle_time_s, figures.under_control
    return (
        f"on the path that the controller drives in {mode}: tip error rms {left.rms_um:.2f} um, max {left.max_um:.2f} um; "
        f"cycle time {times.after:.1f} s, before {times.before:.1f} s"
    )


def warning_lines(warnings: Sequence[str]) -> list[str]:
    """Warnings for the terminal; those that need no action are notes."""
    kinds = [("note" if each.endswith(_NO_ACTION) else "warning", each) for each in warnings]
    return [f"{kind}: {each.removesuffix(_NO_ACTION)}" for kind, each in kinds]


def expected_error_lines(figures: "Summary | Verification") -> list[str]:
    """The error to be expected of real machines, where the machine file states how sure its numbers are."""
    if not (expected := figures.expected):
        return []
    low, high = expected.rms_ci95_um
    text = f"rms {expected.rms_um:.2f} um (95 %: {low:.2f} to {high:.2f}), 95 % of all points below {expected.p95_um:.2f} um"
    return [f"expected on a machine within the stated spreads: {text}", f"{figures.advice}"]
