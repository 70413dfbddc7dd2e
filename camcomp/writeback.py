"""Causes into a machine file: the YAML text gains entries under `effects:`; its comments and layout stay."""

import io
from collections.abc import Mapping, Sequence
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq


def with_causes(text: str, causes: Sequence[Mapping[str, Any]]) -> str:
    """The text of a machine file with the `causes` of a diagnosis appended to its effects; what is unknown is left out.

    causes: as in the result file. Values are those found, intervals go into a comment behind them.
    """
    yaml = YAML()
    yaml.preserve_quotes = True
    yaml.width = 4096
    yaml.indent(mapping=2, sequence=4, offset=2)
    tree = yaml.load(text)
    effects = tree.get("effects")
    if effects is None:
        effects = tree["effects"] = CommentedSeq()
    for cause in causes:
        if cause["effect"] == "unknown":
            continue
        entry = CommentedMap()
        entry["effect"] = cause["effect"]
        if cause["target"] is not None:
            entry["target"] = cause["target"]
        for name, found in cause["parameters"].items():
            entry[name] = found["value"]
            low, high = found["ci95"]
            entry.yaml_add_eol_comment(f"95 %: {low:g} to {high:g}", name)
        effects.append(entry)
    out = io.StringIO()
    yaml.dump(tree, out)
    return out.getvalue()
