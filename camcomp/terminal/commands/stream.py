"""camcomp stream."""

import sys

import click

from camcomp.ground.errors import CheckFailed
from camcomp.terminal.commands._options import config_option


@click.command()
@config_option
@click.option("--json", "as_json", is_flag=True, help="Answer in JSON, one object per line; default CSV.")
@click.option(
    "--columns", metavar="NAMES", help="Order of the columns of CSV lines without a header, with commas: t_s,x_mm,..."
)
def command(configs: tuple[str, ...], as_json: bool, columns: str | None) -> None:
    """Compensate single set-points, line by line, from standard input to standard output.

    A line is a JSON object or CSV with x_mm, y_mm, z_mm (tool tip, program frame), fx_N, fy_N, fz_N (force on the tool,
    machine axes) and, if wanted, t_s. --columns, or a CSV header as the first line, gives another order. Every line is
    answered by one line, at once, empty ones too; a line that cannot be read or solved is answered with an error, and the
    stream goes on. Behind a header that cannot be used no CSV line is read. The answers begin with a header of their own,
    which is the answer to yours; in JSON it is {"columns": [...]}. Exit code 1 when there was an error.
    """
    from camcomp.api.machine import load_machine
    from camcomp.api.set_points import Tally, answer_lines

    machine, tally = load_machine(*configs), Tally()
    try:
        answer_lines(machine, sys.stdin.buffer, sys.stdout.buffer, tally, columns=columns, as_json=as_json)
    finally:
        points, lines = ("s" if number != 1 else "" for number in (tally.count, tally.errors))
        text = f"{tally.count} set-point{points}, {tally.text()}{tally.errors} line{lines} with an error"
        print(text, file=sys.stderr)
    if tally.errors:
        where = "the key `message`" if as_json else "the column `error`"
        raise CheckFailed("CC605", f"{tally.errors} of the set-points have an error; {where} says why")
