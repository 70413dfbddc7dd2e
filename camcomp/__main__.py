"""`camcomp` and `python -m camcomp`."""

import atexit
import os

from camcomp.ground.garbage import collect_seldom


def main() -> None:
    """Run the command line, and end the process without the release of every object, which takes longer than small programs."""
    collect_seldom()  # before the imports
    from camcomp.terminal import cli

    try:
        cli.main()
    except SystemExit as end:
        atexit._run_exitfuncs()
        os._exit(int(end.code or 0))


if __name__ == "__main__":
    main()
