"""camcomp import."""  # noqa: N999 - the file is called like the verb

from pathlib import Path

import click

from camcomp.ground.errors import FileError
from camcomp.ground.files import display_name, read_bytes, write_all
from camcomp.model.config.load import load_config
from camcomp.terminal.commands._options import config_option


@click.command()
@click.argument("files", metavar="FILE...", nargs=-1, required=True)
@config_option
@click.option("-o", "--output-dir", metavar="DIR", required=True, help="Folder of the experiment; made when missing.")
@click.option("--actuator", metavar="NAME", help="Axis to which a recording of one axis belongs; default: the first.")
@click.option(
    "--column", "columns", metavar="LOG=THEIRS", multiple=True, help="Name of a column of theirs; repeatable."
)
@click.option("--holdout", multiple=True, metavar="RUN", help="Run that is judged and never fitted; repeatable.")
@click.option("--rows", type=click.IntRange(min=12), help="At most so many rows of every table, spread evenly.")
def command(
    files: tuple[str, ...], configs: tuple[str, ...], output_dir: str, actuator: str | None, columns: tuple[str, ...],
    holdout: tuple[str, ...], rows: int | None,
) -> None:  # fmt: skip
    """Turn recordings of others into logs and an experiment file.

    FILE is a table of robot poses (CSV with commas or semicolons, decimal points or commas: joint angles in rad, measured
    positions in mm), or a MATLAB file of one axis (t, qg, qm in m, vir, gtau). Every file becomes a run of its own
    with a clamping of its own. The experiment is judged by: camcomp diagnose DIR/experiment.yaml
    """
    from camcomp.diagnosis.experiment.recordings import Recording, experiment_yaml, read_axis, read_poses

    config = load_config(configs)
    given = dict(each.split("=", 1) for each in columns if "=" in each)
    out, recordings = Path(output_dir), list[Recording]()
    for file in files:
        data, name = read_bytes(file), display_name(file)
        read = read_axis if Path(file).suffix.lower() == ".mat" else read_poses
        recordings.append(read(data, name, config.robot.actuators, columns=given, actuator=actuator, rows=rows))
    outputs: dict[Path, bytes] = {out / f"{each.name}.csv": each.log for each in recordings}
    outputs[out / "experiment.yaml"] = experiment_yaml(recordings, configs, out, holdout)
    for path in outputs:
        if path.exists():
            raise FileError("CC501", f"{path} is there already", hint="choose another folder")
    out.mkdir(parents=True, exist_ok=True)
    write_all(outputs, inputs=(*files, *configs))
    for each in recordings:
        click.echo(f"{each.name}: {each.rows} rows; {'; '.join(each.notes) or 'complete'}", err=True)
    click.echo(f"next: camcomp diagnose {out / 'experiment.yaml'}", err=True)
