"""`@NAME|TAG|key=value|...`: how the Makera posts of FreeCAD and Fusion write tools, stock and origin.

STOCK: width along X, depth along Y, height along Z. ORIGIN: the program's zero seen from the middle of the stock.
"""

from collections.abc import Iterator, Sequence

from camcomp.gcode.stated import (
    Comment,
    OpenStatement,
    StatedError,
    StatedMaterial,
    StatedTool,
    Statement,
    bar,
    box,
    cutter,
    form_of,
    numbers,
    read_each,
)

_FORMS = {"endmill": "flat", "ballend": "ball", "bullnose": "bull", "drill": "drill"}
_MORE_FORMS = {
    "flat end mill": "flat",
    "ball end mill": "ball",
    "bull nose end mill": "bull",
    "bull nose mill": "bull",
    "face mill": "flat",
}
SAME = 1e-6  # of a diameter


def read_pipes(comments: Sequence[Comment], name: str) -> Iterator[Statement]:
    """Statements of the comments that begin with `@name|`."""
    found: dict[str, list[tuple[Comment, dict[str, str]]]] = {"TOOL": [], "MATERIAL": [], "STOCK": [], "ORIGIN": []}
    for comment in comments:
        head, *words = comment.text.split("|")
        if head.strip().upper() == f"@{name}" and words and (rows := found.get(words[0].strip().upper())) is not None:
            pairs = (each.partition("=") for each in words[1:])
            rows.append((comment, {key.strip().lower(): value.strip() for key, sign, value in pairs if sign}))
    fields = {comment: words for rows in found.values() for comment, words in rows}
    yield from read_each([each for each, _ in found["TOOL"]], lambda each: _tool(each, fields[each]))
    yield from (StatedMaterial(comment, words.get("name", "")) for comment, words in found["MATERIAL"])
    stocks, origins = found["STOCK"], found["ORIGIN"]
    if any(len({each.text for each, _ in rows}) > 1 for rows in (stocks, origins)):
        yield OpenStatement((stocks or origins)[-1][0], "several stocks or places of the zero are stated")
    elif stocks:
        yield from read_each([stocks[0][0]], lambda each: _stock(each, fields[each], origins[0] if origins else None))


def _value(comment: Comment, fields: dict[str, str], key: str) -> float:
    if key not in fields:
        raise StatedError(comment, f"{key} is missing")
    return numbers(comment, [fields[key]], key)[0]


def _stock(comment: Comment, fields: dict[str, str], origin: tuple[Comment, dict[str, str]] | None) -> Statement:
    kind = fields.get("id", "").lower()
    if kind not in ("box", "cylinder"):
        return OpenStatement(comment, f"a stock of the form '{kind}' cannot be followed")
    if origin is None or not {"x", "y", "z"} <= set(origin[1]):
        return OpenStatement(comment, "the place of the program's zero on the stock (ORIGIN) is not stated")
    at = [_value(origin[0], origin[1], axis) for axis in "xyz"]
    size = [_value(comment, fields, key) for key in ("width", "depth", "height")]
    low = [-0.5 * s - a for s, a in zip(size, at, strict=True)]
    high = [0.5 * s - a for s, a in zip(size, at, strict=True)]
    if kind == "box":
        return box(comment, low, high)
    diameter = _value(comment, fields, "diameter")
    if abs(size[0] - diameter) > SAME * diameter or abs(size[1] - diameter) > SAME * diameter:
        return OpenStatement(comment, "a bar that does not stand along Z cannot be followed")
    return bar(comment, (-at[0], -at[1]), diameter, low[2], high[2])


def _tool(comment: Comment, fields: dict[str, str]) -> Statement:
    name = fields.get("type", "").lower()
    form = _FORMS.get(name) or _MORE_FORMS.get(name)
    stated = _value(comment, fields, "number")
    if stated != (number := int(stated)):
        raise StatedError(comment, f"{stated:g} is no tool number")
    if form is None:
        return OpenStatement(comment, f"T{number}: a tool of the type '{fields.get('type', '')}' cannot be followed")
    diameter = _value(comment, fields, "diameter")
    corner = _value(comment, fields, "cornerradius") if "cornerradius" in fields else 0.0
    if form == "bull":
        form = form_of(diameter, corner)
    flute = _value(comment, fields, "flutelength") if "flutelength" in fields else 0.0
    keys = cutter(comment, form, diameter, corner, flute)
    if form == "drill" and "tipangle" in fields and 0.0 < (tip := _value(comment, fields, "tipangle")) < 180.0:
        keys["point_deg"] = tip
    return StatedTool(comment, number, keys)
