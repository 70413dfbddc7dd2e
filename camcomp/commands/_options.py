"""Options that several verbs share."""

import click

config_option = click.option(
    "--config",
    "configs",
    metavar="FILE",
    multiple=True,
    required=True,
    help="Machine file (YAML); may be given several times, later files override earlier ones key by key.",
)
