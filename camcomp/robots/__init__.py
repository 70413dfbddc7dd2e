"""One file per way to describe a robot in YAML, each with PARAMS and a function that makes its chains."""
