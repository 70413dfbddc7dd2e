"""camcomp simulate."""

import click

from camcomp.ground.files import write_all
from camcomp.ground.places import STANDARD
from camcomp.model.config.load import load_config
from camcomp.terminal.commands._options import OUTPUT
from camcomp.terminal.progress import say


@click.command()
@click.argument("program")
@click.option("--config", "configs", metavar="FILE", multiple=True, required=True, help="Machine; later files win.")
@click.option("-o", "--output", metavar="LOG.csv", type=OUTPUT, help="The log; default and -: standard output.")
@click.option("--step-s", type=click.FloatRange(min=1e-5), default=0.02, show_default=True, help="Time between rows.")
@click.option("--air", is_flag=True, help="The tool does not cut.")
@click.option("--started-s", type=float, default=0.0, help="Start on the common clock, for effects of warming up.")
def command(
    program: str, configs: tuple[str, ...], output: str | None, step_s: float, air: bool, started_s: float
) -> None:
    """Write the log that the modelled machine would produce.

    The model is the config with its `effects:`; there is no noise. Columns and frames are those that diagnose reads.
    """
    config = load_config(configs)
    from camcomp.model.control import open_program
    from camcomp.model.job import Job
    from camcomp.model.motion.simulate import log_table, simulate

    source = open_program(program, config)
    run = simulate(Job(config), source.path, step_s, cutting=not air, started_s=started_s)
    for each in run.warnings:
        say(f"warning: {each}")
    write_all({output or STANDARD: log_table(run).encode()}, inputs=(program, *configs))
