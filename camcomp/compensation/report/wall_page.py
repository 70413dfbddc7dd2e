"""The report of a simulated cut: the walls that the bent tool leaves."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePath

import numpy as np

from camcomp.compensation.report.wall_drawing import wall_section
from camcomp.gcode.program import Program
from camcomp.ground.errors import ConfigError
from camcomp.model.job import Job
from camcomp.report.inputs import Input, inputs_section
from camcomp.report.page import Page, Section, render


def walls_html(job: Job, program: Program, inputs: Sequence[Input]) -> bytes:
    """One HTML file. Raises ConfigError CC298 without a stock, CC216 when the plot library is not installed."""
    if job.config.workpiece.stock is None:
        message = "there is no stock that could be cut"
        raise ConfigError("CC298", message, at=job.config.at("workpiece"), hint="add workpiece: stock")
    section = wall_section(job, program, [("as written", program)])
    drawn = section is not None and bool(section.figures)
    lines = int(np.unique(program.path.line).size)
    verdict = "No wall is left that could be drawn."
    if drawn:
        verdict = "Walls as the loaded machine leaves them; how far they are off stands below the drawings."
    page = Page(
        title=f"{PurePath(program.name).name} on {job.config.robot.name}",
        subtitle=f"Simulated cut: what the loaded machine leaves of the stock, {lines} lines with motions",
        verdict=verdict,
        good=drawn,
        cards=[],
        sections=[section or Section(name="walls", title="Walls", text=[verdict]), inputs_section(inputs)],
        word="Cut" if drawn else "",
    )
    return render(page)
