"""FreeCAD: a library `.fctl` names tool bits by number, a tool bit `.fctb` states shape and sizes with their units.

Source: FreeCAD's files `Tools/Library/Default.fctl` and `Tools/Bit/*.fctb`. A library's bits lie in its own folder or in
`Bit` beside it. The length of a bit is that of the whole tool and no length offset of the control.
"""

import re
from collections.abc import Iterator
from pathlib import Path

from camcomp.gcode.stated import INCH_MM
from camcomp.ground.bounds import number_of
from camcomp.ground.errors import FileError
from camcomp.ground.files import read_bytes
from camcomp.ground.records import replace
from camcomp.model.config.tool_table import TabledTool, ToolFile, refused
from camcomp.model.config.yaml_text import read_tree
from camcomp.model.config.yaml_tree import Node, child

TITLE = "FreeCAD tool library (.fctl) or tool bit (.fctb)"
SUFFIXES = (".fctl", ".fctb")
STATES_UNIT = True
_FORMS = {"endmill": "flat", "ballend": "ball", "bullnose": "bull", "drill": "drill"}
_UNITS = {"mm": 1.0, "": 1.0, "cm": 10.0, "m": 1000.0, "um": 1e-3, "µm": 1e-3, "in": INCH_MM, '"': INCH_MM}
_DEGREES = {"°": 1.0, "deg": 1.0, "": 1.0}
_QUANTITY = re.compile(r"\s*([-+]?[\d.,]+(?:[eE][-+]?\d+)?)\s*(.*?)\s*")


def read(file: ToolFile) -> Iterator[TabledTool]:
    """The tools of a library, or the one of a tool bit."""
    tree = _tree(file)
    if file.path.suffix.lower() == ".fctb":
        yield _bit(tree)
        return
    listed = child(tree, "tools")
    if listed is None or not isinstance(listed.value, list):
        raise refused("the library has no list of tools", tree.at)
    for each in listed.value:
        number, path = child(each, "nr"), child(each, "path")
        if number is None or type(number.value) is not int or number.value < 0:
            raise refused("a tool of the library has no number 'nr'", each.at)
        if path is None or Path(str(path.value)).suffix.lower() != ".fctb":
            raise refused(f"tool {number.value} names no tool bit (.fctb)", each.at)
        yield replace(_bit(_tree(_beside(file.path, path))), number=number.value)


def _beside(library: Path, named: Node) -> ToolFile:
    """The tool bit that a library names. Raises ConfigError CC299."""
    places = [library.parent / named.value, library.parent.parent / "Bit" / named.value]
    for place in places:
        try:
            return ToolFile(place, read_bytes(place))
        except FileError:
            continue
    hint = f"looked for {' and '.join(str(each) for each in places)}"
    raise refused(f"the tool bit '{named.value}' cannot be read", named.at, hint)


def _tree(file: ToolFile) -> Node:
    tree, errors = read_tree(file.data, file.name)
    if errors or tree is None:
        raise refused(f"the file is no JSON: {errors[0].message}", errors[0].at)
    return tree


def _bit(tree: Node) -> TabledTool:
    shape = child(tree, "shape-type") or child(tree, "shape")
    if shape is None or not isinstance(shape.value, str):
        raise refused("the tool bit states no shape", tree.at)
    kind = Path(shape.value).stem.lower()
    form = _FORMS.get(kind)
    if form is None:
        return TabledTool(number=None, at=tree.at, why_open=kind)
    parts = [part for key in ("attribute", "parameter") if (part := child(tree, key)) and isinstance(part.value, dict)]
    given = {key: each for part in parts for key, each in part.value.items()}
    if "Diameter" not in given:
        raise refused("the tool bit states no Diameter", tree.at)
    keys = {"type": Node(form, shape.at), "diameter_mm": _size(given["Diameter"], _UNITS)}
    if form == "bull":
        corner = _corner(given, keys["diameter_mm"].value)
        if corner is None:
            return TabledTool(number=None, at=tree.at, why_open="bullnose without CornerRadius or FlatRadius")
        keys["corner_radius_mm"] = corner
    if form == "drill" and "TipAngle" in given:
        keys["point_deg"] = _size(given["TipAngle"], _DEGREES)
    if "CuttingEdgeHeight" in given:
        keys["flute_length_mm"] = _size(given["CuttingEdgeHeight"], _UNITS)
    if "Flutes" in given and (teeth := _size(given["Flutes"], {"": 1.0})).value >= 1.0:
        keys["teeth"] = replace(teeth, value=int(teeth.value))
    return TabledTool(number=None, at=tree.at, keys=keys)


def _corner(given: dict[str, Node], diameter: float) -> Node | None:
    """The corner radius of a bull nose. FreeCAD up to 1.0 states the radius of the flat part of the bottom."""
    if "CornerRadius" in given:
        return _size(given["CornerRadius"], _UNITS)
    if "FlatRadius" in given:
        flat = _size(given["FlatRadius"], _UNITS)
        return replace(flat, value=round(0.5 * diameter - flat.value, 9))
    return None


def _size(given: Node, units: dict[str, float]) -> Node:
    """A quantity such as "6.0000 mm"; FreeCAD writes it with the decimal sign of the user's language."""
    found = _QUANTITY.fullmatch(str(given.value))
    value = number_of(found[1].replace(",", ".") if "." not in found[1] else found[1]) if found else None
    if found is None or value is None or found[2] not in units:
        raise refused(f"'{given.value}' is no size", given.at, f"units here: {', '.join(filter(None, units))}")
    return Node(round(value * units[found[2]], 9), given.at)
