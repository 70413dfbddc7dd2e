"""camcomp history."""

from collections.abc import Sequence
from datetime import date, datetime
from typing import TYPE_CHECKING

import click

from camcomp.ground.errors import shown
from camcomp.ground.files import write_all
from camcomp.ground.places import STANDARD
from camcomp.terminal.commands._options import OUTPUT
from camcomp.terminal.progress import say

if TYPE_CHECKING:
    from camcomp.api.history import Chronicle, ParameterCourse

# Values of standards by their names in the JSON, which has those of one direction of ISO 230-2, too.
SHOWN = {
    "A": "A", "R": "R", "B": "B", "E": "E", "M": "M", "G": "G", "G_both": "G(b)", "F_max": "F max", "F_min": "F min",
    "AP": "AP", "RP": "RP",
}  # fmt: skip


@click.command()
@click.argument("folder", metavar="DIR")
@click.option("--add", "added", metavar="RESULT.json", multiple=True, help="Keep this result of diagnose; repeatable.")
@click.option(
    "--day", type=click.DateTime(["%Y-%m-%d"]), help="Day on which the runs of --add were measured; default: today."
)
@click.option("--json", "json_file", metavar="OUT.json", type=OUTPUT, help="The history as JSON.")
@click.option(
    "--tolerance-um", type=click.FloatRange(min=0.01), default=10.0, show_default=True,
    help="How far the tip may drift before it is measured again.",
)  # fmt: skip
def command(
    folder: str, added: Sequence[str], day: datetime | None, json_file: str | None, tolerance_um: float
) -> None:
    """Store the diagnoses of a machine and show the drift of its parameters.

    DIR is a folder of one machine; --add puts results of `camcomp diagnose --json` into it. For every parameter that was
    ever found: its values over the days, whether it stays, drifts or has jumped, and when to measure again. So are values of
    ISO 230-2 (positioning of an axis), ISO 230-4 (circles) and ISO 9283 (pose of an arm) where the logs held them.
    """
    from camcomp.api.history import history, keep_diagnosis

    when = day.date() if day else date.today()
    for each in added:
        say(f"kept: {keep_diagnosis(folder, each, when)}")
    found = history(folder, tolerance_um)
    if json_file:
        write_all({json_file: found.to_json()})
    if json_file != STANDARD:
        click.echo(shown("\n".join(_text(found))))


def _text(found: "Chronicle") -> list[str]:
    from camcomp.report.plot import format_together

    if not found.verdicts:
        return ["nothing is kept here yet"]
    out = [
        f"{each.day}  {each.verdict}: gap {each.gap_rms_um:.3g} um"
        + (f", {', '.join(each.causes)}" if each.causes else "")
        for each in found.verdicts
    ]
    for each in found.parameters:
        name = f"{each.effect} ({each.target})" if each.target else each.effect
        last = each.values[-1]
        told, low, high = format_together(last.value, *last.ci95)
        out.append(f"{name} {each.parameter}: {told} ({low} to {high}) on {last.day}; {_course(each)}")
    places: dict[str, list[str]] = {}
    for value in found.standards:
        if value.name in SHOWN:
            (first, before), (latest, now) = value.values[0], value.values[-1]
            since = f" and since {first}" if latest > first else ""
            change = f" ({now - before:+.3g})" if latest > first else ""
            head = f"{value.standard}, {value.place}, on {latest}{since}"
            places.setdefault(head, []).append(f"{SHOWN[value.name]} {now:.4g} um{change}")
    out += [f"{head}: {', '.join(values)}" for head, values in places.items()]
    if found.measure_again:
        out.append(f"measure again by {found.measure_again}")
    return out


def _course(each: "ParameterCourse") -> str:
    if each.course == "drift":
        low, high = each.rate_ci95
        return f"drifts by {each.rate_per_year:.3g} a year ({low:.3g} to {high:.3g})"
    if each.course == "jumps":
        return f"jumped on {', '.join(str(day) for day in each.changed)}"
    if each.course == "too few":
        return f"{len(each.values)} of the 4 measurements that a trend needs"
    return f"steady over {len(each.values)} measurements"
