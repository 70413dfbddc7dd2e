"""Replacement of standard streams that the caller has closed (`<&-`, `>&-`, `2>&-`), so that no file gets their numbers."""

import os
import sys


def stand_in_for_closed() -> None:
    """Open a replacement for every closed standard stream.

    Reading input and writing output raise OSError, as in other programs; messages are discarded.
    """
    ways = (("stdin", os.O_WRONLY, "r"), ("stdout", os.O_RDONLY, "w"), ("stderr", os.O_WRONLY, "w"))
    for number, (name, way, mode) in enumerate(ways):
        if getattr(sys, name) is None:
            file = os.open(os.devnull, way)
            if file != number:
                os.dup2(file, number)
                os.close(file)
            setattr(sys, name, open(number, mode, encoding="utf-8"))  # noqa: SIM115 - open as long as the process
