"""One name, one thing: no two public classes of camcomp are called alike."""

import ast
from collections import defaultdict
from pathlib import Path

import camcomp

PACKAGE = Path(camcomp.__file__).parent
OF_PLUG_INS = {"Params"}  # the keys of a plug-in, which is always named beside it


def test_no_two_public_classes_share_a_name():
    places = defaultdict(list)
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].append(f"{path.relative_to(PACKAGE)}:{node.lineno}")
    shared = {name: found for name, found in places.items() if len(found) > 1 and name not in OF_PLUG_INS}
    assert shared == {}
