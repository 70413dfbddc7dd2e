"""LinuxCNC's preview: `(WORKPIECE,BOX,XMIN=0,...)`, `(WORKPIECE,CYLINDER,AXIS=Z,...)`, in the unit in force.

Source: LinuxCNC pull request 4476 (2026), which draws them in the current work offset.
"""

from collections.abc import Iterator, Sequence

from camcomp.gcode.stated import Comment, OpenStatement, StatedError, Statement, bar, box, numbers, read_each

TITLE = "LinuxCNC (WORKPIECE,...)"
MARKS = (b"WORKPIECE,",)
_BOX = ("XMIN", "YMIN", "ZMIN", "XMAX", "YMAX", "ZMAX")


def read(comments: Sequence[Comment]) -> Iterator[Statement]:
    """The stock of every comment."""
    return read_each(comments, _stock)


def _stock(comment: Comment) -> Statement | None:
    head, *words = (each.strip() for each in comment.text.split(","))
    if head.upper() != "WORKPIECE" or not words:
        return None
    shape, fields = words[0].upper(), _fields(comment, words[1:])
    if shape == "BOX":
        values = numbers(comment, [_need(comment, fields, key) for key in _BOX], "BOX")
        return box(comment, values[:3], values[3:])
    if shape == "CYLINDER" and fields.get("AXIS", "Z").upper() == "Z":
        keys = ("X", "Y", "DIAMETER", "ZMIN", "ZMAX")
        x, y, diameter, low, high = numbers(comment, [_need(comment, fields, key) for key in keys], "CYLINDER")
        return bar(comment, (x, y), diameter, low, high)
    kind = f"{shape} along {fields.get('AXIS', 'Z')}" if shape == "CYLINDER" else shape
    return OpenStatement(comment, f"a workpiece of the form {kind} cannot be followed")


def _fields(comment: Comment, words: Sequence[str]) -> dict[str, str]:
    out = {}
    for word in words:
        key, sign, value = word.partition("=")
        if not sign:
            raise StatedError(comment, f"'{word}' is no KEY=VALUE")
        out[key.strip().upper()] = value.strip()
    return out


def _need(comment: Comment, fields: dict[str, str], key: str) -> str:
    if key not in fields:
        raise StatedError(comment, f"{key} is missing")
    return fields[key]
