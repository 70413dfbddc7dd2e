"""What several commands say in the same words."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from camcomp.compensation.program.result import Summary, Verification


def control_told(figures: "Summary | Verification") -> str:
    """What the control makes of the program."""
    mode = figures.control_mode + ("" if figures.control_mode_stated else " (assumed)")
    times, left = figures.cycle_time_s, figures.under_control
    return (
        f"control in {mode}: {times.before:.1f} s become {times.after:.1f} s; "
        f"it takes the tip error to rms {left.rms_um:.2f} um, max {left.max_um:.2f} um"
    )
