"""camcomp import."""  # noqa: N999 - the file is called like the verb

from pathlib import Path

import click

from camcomp.terminal.commands._options import config_option
from camcomp.terminal.progress import say, working


@click.command()
@click.argument("files", metavar="FILE...", nargs=-1, required=True)
@config_option
@click.option("-o", "--output-dir", metavar="DIR", required=True, help="Folder of the experiment; made when missing.")
@click.option("--actuator", metavar="NAME", help="Axis to which a recording of one axis belongs; default: the first.")
@click.option(
    "--column", "columns", metavar="LOG=THEIRS[*FACTOR]", multiple=True,
    help="Which column of theirs a column of the log is, by its name or, without header, its number, times a factor to the "
    "log's unit: act_x_N=X1_Current*120; repeatable.",
)  # fmt: skip
@click.option(
    "--columns", "names", metavar="'NAME NAME ...'", multiple=True,
    help="Names of the columns of a table without header, in their order; - leaves one out. halsampler's sample number "
    "need not be named. Given several times: for the files of FILE+FILE in their order.",
)  # fmt: skip
@click.option("--period-s", type=click.FloatRange(min=0.0, min_open=True), metavar="S",
              help="Time between samples of a table without times; default for halsampler -t: 0.001.")  # fmt: skip
@click.option(
    "--degrees/--radians",
    default=None,
    help="Whether joint angles are degrees; default: as the recording states, else by size.",
)
@click.option(
    "--join", "by", type=click.Choice(["time", "rows"]), help="How files of one run are joined; default: see above."
)
@click.option(
    "--program", "programs", metavar="[RUN=]FILE", multiple=True, help="Program of a run, or of all; repeatable."
)
@click.option("--cutting", is_flag=True, help="The runs cut; default: in the air.")
@click.option("--one-clamping", is_flag=True, help="All runs were taken in one clamping; default: each in its own.")
@click.option("--holdout", multiple=True, metavar="RUN", help="Run that is judged and never fitted; repeatable.")
@click.option("--rows", type=click.IntRange(min=12), help="At most so many rows of every table, spread evenly.")
def command(
    *, files: tuple[str, ...], configs: tuple[str, ...], output_dir: str, actuator: str | None, columns: tuple[str, ...],
    names: tuple[str, ...], period_s: float | None, degrees: bool | None, by: str | None, programs: tuple[str, ...], cutting: bool,
    one_clamping: bool, holdout: tuple[str, ...], rows: int | None,
) -> None:  # fmt: skip
    """Turn recordings of others into logs and an experiment file.

    FILE is a table (CSV with commas, semicolons or tabs, decimal points or commas; blank-separated with or without header;
    XLSX), the output of LinuxCNC's halsampler, a text export of TwinCAT Scope, MCAP, TDMS, or a MATLAB file of one axis (t,
    qg, qm in m, vir, gtau). XLSX, MCAP and TDMS need: pip install 'camcomp[import]'. Lengths are mm and angles rad unless
    the recording states a unit (in brackets, at the end of a name, as ROS does) or angles exceed two turns.

    A column is found by the log's name for it, by the actuator's name, alone or with _joint, and by usual names of what is
    measured; in MCAP and TDMS it is called topic.field and group.channel. What is not used is said.

    Every FILE becomes a run called by its stem. FILE+FILE is one run in two files (joints in one, tracker in the other):
    joined row by row where they have equally many rows, else on their common time. The experiment is judged by: camcomp
    diagnose DIR/experiment.yaml
    """
    from camcomp.api.recordings import import_recordings

    with working(f"reading {len(files)} recordings" if len(files) > 1 else f"reading {files[0]}"):
        runs, experiment = import_recordings(
            files, configs, output_dir, actuator=actuator, columns=columns, names=names, period_s=period_s, degrees=degrees,
            by=by, programs=programs, cutting=cutting, one_clamping=one_clamping, holdout=holdout, rows=rows,
        )  # fmt: skip
    for each, file in zip(runs, files, strict=True):
        renamed = "" if each.name == Path(file.split("+")[0]).stem or file == "-" else f" ({file})"
        say(f"{each.name}{renamed}: {each.rows} rows; {'; '.join(each.notes) or 'complete'}")
    say(f"next: camcomp diagnose {experiment}")
