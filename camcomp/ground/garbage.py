"""When Python looks for objects that only hold each other."""

import gc


def collect_seldom() -> None:
    """For processes of our own: imports make thousands of objects that stay; to look through them at every 700 takes 0.2 s."""
    gc.set_threshold(50_000)


def keep_what_lives() -> None:
    """For processes that do one task after the other: what the first left for the others is not looked through again.

    The pool's own checks for leaks collect after every task, which takes 0.06 s each time otherwise.
    """
    gc.freeze()
