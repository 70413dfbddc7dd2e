"""Standard streams that the caller has closed (`<&-`, `>&-`, `2>&-`): their numbers must not go to the next file opened."""

import os
import sys


def stand_in_for_closed() -> None:
    """Puts something in place of every closed standard stream.

    Reading input and writing output fail with an OSError, as they do in other programs; messages go nowhere.
    """
    ways = (("stdin", os.O_WRONLY, "r"), ("stdout", os.O_RDONLY, "w"), ("stderr", os.O_WRONLY, "w"))
    for number, (name, way, mode) in enumerate(ways):
        if getattr(sys, name) is None:
            file = os.open(os.devnull, way)
            if file != number:
                os.dup2(file, number)
                os.close(file)
            setattr(sys, name, open(number, mode, encoding="utf-8"))  # noqa: SIM115 - open as long as the process
