"""One file per description of robots in YAML, each with a class Params and a function `chains`."""
