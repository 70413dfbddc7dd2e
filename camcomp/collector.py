"""When Python looks for objects that only hold each other."""

import gc


def collect_seldom() -> None:
    """For processes of our own: imports make thousands of objects that stay; to look through them at every 700 takes 0.2 s."""
    gc.set_threshold(50_000)
