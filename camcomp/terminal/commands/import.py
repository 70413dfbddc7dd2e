"""camcomp import."""  # noqa: N999 - the file is called like the verb

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from camcomp.ground.errors import FileError
from camcomp.ground.files import display_name, read_bytes, write_all
from camcomp.model.config.load import load_config
from camcomp.terminal.commands._options import config_option

if TYPE_CHECKING:
    from camcomp.diagnosis.recordings.sampled import SampledColumns


@click.command()
@click.argument("files", metavar="FILE...", nargs=-1, required=True)
@config_option
@click.option("-o", "--output-dir", metavar="DIR", required=True, help="Folder of the experiment; made when missing.")
@click.option("--actuator", metavar="NAME", help="Axis to which a recording of one axis belongs; default: the first.")
@click.option(
    "--column", "columns", metavar="LOG=THEIRS", multiple=True,
    help="Which column of theirs a column of the log is, by its name or, without header, its number; repeatable.",
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
    files: tuple[str, ...], configs: tuple[str, ...], output_dir: str, actuator: str | None, columns: tuple[str, ...],
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
    from camcomp.diagnosis.recordings.axis_file import read_axis
    from camcomp.diagnosis.recordings.experiment_file import experiment_yaml, run_names
    from camcomp.diagnosis.recordings.naming import told_columns
    from camcomp.diagnosis.recordings.run_log import Recording, Wishes, log_of

    actuators = load_config(configs).robot.actuators
    groups = [_files_of(each) for each in files]
    called = run_names([group[0] for group in groups])
    run_programs = _programs(programs, called)
    told = told_columns(columns, list(actuators), [each.rotary for each in actuators.values()])
    recordings = list[Recording]()
    for run, group in zip(called, groups, strict=True):
        wishes = Wishes(told, rows, degrees, period_s, by, run in run_programs)
        if len(group) == 1 and Path(group[0]).suffix.lower() == ".mat":
            read = read_axis(read_bytes(group[0]), display_name(group[0]), run, actuators, actuator, wishes)
        else:
            read = log_of(run, _parts(group, [each.split() for each in names], period_s), actuators, wishes)
        recordings.append(read)
    out = Path(output_dir)
    outputs: dict[Path, bytes] = {out / f"{each.name}.csv": each.log for each in recordings}
    outputs[out / "experiment.yaml"] = experiment_yaml(
        recordings, configs, out, holdout, run_programs, cutting=cutting, one_clamping=one_clamping
    )
    _write(out, outputs, [*(file for group in groups for file in group), *configs, *run_programs.values()])
    for each, file in zip(recordings, files, strict=True):
        renamed = "" if each.name == Path(file.split("+")[0]).stem or file == "-" else f" ({file})"
        click.echo(f"{each.name}{renamed}: {each.rows} rows; {'; '.join(each.notes) or 'complete'}", err=True)
    click.echo(f"next: camcomp diagnose {out / 'experiment.yaml'}", err=True)


def _files_of(word: str) -> list[str]:
    """Files of one run: a file, or several joined by +."""
    return [word] if os.path.lexists(word) else word.split("+")


def _parts(group: Sequence[str], names: Sequence[Sequence[str]], period_s: float | None) -> "list[SampledColumns]":
    """What the files of one run hold; names: of columns of tables without header, by file, the last for all others."""
    from camcomp.diagnosis.recordings.formats import read_sampled
    from camcomp.diagnosis.recordings.sampled import refuse_names

    parts = list["SampledColumns"]()
    for k, file in enumerate(group):
        own = names[min(k, len(names) - 1)] if names else ()
        parts += read_sampled(read_bytes(file), display_name(file), own, period_s)
    refuse_names(parts, names)
    return parts


def _programs(words: Sequence[str], runs: Sequence[str]) -> dict[str, str]:
    """Program by run. Raises FileError CC500 for one that is not there."""
    out: dict[str, str] = {}
    for word in words:
        run, mark, file = word.partition("=")
        named = bool(mark) and not os.path.lexists(word)
        file = file if named else word
        read_bytes(file)
        out |= {run: file} if named else dict.fromkeys(runs, file)
    return out


def _write(out: Path, outputs: dict[Path, bytes], inputs: Sequence[str]) -> None:
    for path in outputs:
        if os.path.lexists(path):
            raise FileError("CC501", f"{path} is there already", hint="choose another folder")
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError("CC501", f"cannot make {out}: {error.strerror}") from error
    write_all(outputs, inputs=inputs)
