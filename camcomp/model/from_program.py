"""Stock and tools from the comments of a program, for values that the machine file does not state."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from io import BytesIO
from typing import Any, BinaryIO, Literal

from camcomp.gcode.stated import INCH_MM, Stated, StatedMaterial, StatedStock, StatedTool, read_stated
from camcomp.ground.errors import Location, ProgramError
from camcomp.ground.records import replace
from camcomp.model.config.cutting_tool import BoxStock, CommentsStock, Cutter, CylinderStock, ProgramStock, Stock
from camcomp.model.config.spec import Config
from camcomp.model.config.taken import TakenFromProgram
from camcomp.model.control import setup_of
from camcomp.model.job import Job

StockChoice = Literal["none", "program", "comments"]
SAME_MM = 1e-3  # difference below which lengths are equal: posts write three decimals
MOST_REMARKS = 20  # contradictions and doubts of one program that are said one by one


def job_of_program(job: Job, source: BinaryIO | bytes, name: str, choice: StockChoice | None = None) -> Job:
    """Add stock and tools of the program's comments to a job; values of the machine file take precedence.

    Args:
        job: the job of the machine file.
        source: the program's bytes, or a file at its start, which is reset to it.
        name: of the program, for messages.
        choice: source of the stock; None: the machine file, else the comments.

    Returns:
        The job; contradictions between comments and machine file are among its remarks.

    Raises:
        ProgramError: CC143, the stock is to come from comments that do not state it, or contradict each other; CC147, the
            unit of length stands in a comment only, and it is not mm.
    """
    stated = read_stated(BytesIO(source) if isinstance(source, bytes) else source, setup_of(job.config).unit_mm)
    remarks = _unit_remarks(stated, name, job.config.control.program_unit)
    if choice == "none":
        return _taking(job, TakenFromProgram(has_stock=True, remarks=tuple(remarks)))
    tools, said, contradictions = _tools_of(job.config, stated)
    own = job.config.workpiece.stock
    found, doubts = _stock_of(stated)
    required = choice == "comments" or (choice is None and isinstance(own, CommentsStock))
    if required and found is None:
        _refuse(name, stated, doubts)
    remarks += [*contradictions, *(f"not taken from the program: {each}" for each in doubts)]
    stock: Stock | None = None
    if choice == "program":
        stock = own if isinstance(own, ProgramStock) else ProgramStock(type="program")
    elif found is not None:
        read, text = _as_spec(found.keys), _stock_text(found)
        if required or own is None:
            stock = read
            said.append((found.comment.line, text))
        elif _differ(read, own):
            remarks.append(f"{text} contradicts workpiece: stock {_words(own)}, which counts")
    said += [(each.comment.line, _material_text(each)) for each in stated.materials]
    remarks += _contradicting_materials(stated)
    lines = tuple(dict.fromkeys(text for _, text in sorted(said, key=lambda each: each[0])))
    remarks = list(dict.fromkeys(remarks))
    if len(remarks) > MOST_REMARKS:
        remarks[MOST_REMARKS:] = [f"{len(remarks) - MOST_REMARKS} more comments are not taken or contradict"]
    return _taking(job, TakenFromProgram(stock is not None, stock, tools, lines, tuple(remarks)))


def _taking(job: Job, taken: TakenFromProgram) -> Job:
    tables = tuple(
        f"{each.at.file}:{each.at.line}: {each.text}" if each.at else each.text for each in job.config.doubts
    )
    if tables:
        taken = replace(taken, remarks=(*tables, *taken.remarks))
    return job if taken == TakenFromProgram() else replace(job, config=taken.into(job.config), taken=taken)


def _refuse(name: str, stated: Stated, doubts: list[str]) -> None:
    comments = [each.comment for each in stated.stocks] + [each.comment for each in stated.doubts]
    at = Location(name, comments[0].line, comments[0].column, comments[0].text) if comments else Location(name, 1, 1)
    raise ProgramError("CC143", doubts[0] if doubts else "no comment states the stock", at=at)


def _unit_remarks(stated: Stated, name: str, own: str | None) -> list[str]:
    """Comments that name another unit than the one in force. Raises ProgramError CC147 if no code states a unit."""
    out = []
    for each in stated.units:
        if each.size_mm == each.comment.unit_mm:
            continue
        unit, other = ("inch", "mm") if each.size_mm == INCH_MM else ("mm", "inch")
        at = Location(name, each.comment.line, each.comment.column, each.comment.text)
        if not stated.has_unit and own is None:
            raise ProgramError(
                "CC147", f"the comment says {unit}, and no G20 or G21 (G70, G71) is in the program", at=at
            )
        counts = "the program's unit code" if stated.has_unit else "control: program_unit"
        out.append(f"line {at.line}: the comment says {unit}, and {counts} says {other}, which counts")
    return out


def _stock_of(stated: Stated) -> tuple[StatedStock | None, list[str]]:
    """Stock on which all comments agree, and reasons to doubt it."""
    doubts = [f"line {each.comment.line}: {each.reader}: {each.why}" for each in stated.doubts]
    if not stated.stocks:
        return None, doubts
    first, *others = stated.stocks
    for each in others:
        if _differ(_as_spec(first.keys), _as_spec(each.keys)):
            return None, [f"{_stock_text(first)} contradicts {_stock_text(each)}", *doubts]
    if other := sorted(stated.offsets - {"G54"}):
        line = f"line {first.comment.line}: {first.reader}"
        return None, [f"{line}: the stock's place is that of a work offset, and the program uses {other[0]}", *doubts]
    return first, doubts


def _tools_of(config: Config, stated: Stated) -> tuple[dict[int, Cutter], list[tuple[int, str]], list[str]]:
    """Tools that the config does not state, (line, text) of the values read, and contradictions.

    A key of the config that a comment contradicts keeps the whole tool as the config states it.
    """
    tools: dict[int, Cutter] = {}
    said, remarks = list[tuple[int, str]](), list[str]()
    by_number: dict[int, list[StatedTool]] = {}
    for each in stated.tools:
        by_number.setdefault(each.number, []).append(each)
    for number, (first, *others) in by_number.items():
        if other := next((each for each in others if _other_keys(first.keys, each.keys)), None):
            remarks.append(f"{_tool_text(first)} contradicts {_tool_text(other)}: neither is taken")
            continue
        known: Cutter = config.tools.get(number) or config.tool
        own = {key: value for key in Cutter.model_fields if (value := getattr(known, key)) is not None}
        if _other_keys(own, first.keys):
            key = f"tools: {number}" if number in config.tools else "tool"
            remarks.append(f"{_tool_text(first)} contradicts {key}: {_cutter_words(own)}, which counts")
        elif {"type": "flat", **own} != {"type": "flat", **first.keys, **own}:
            tools[number] = Cutter.model_validate({"teeth": config.tool.teeth, **first.keys, **own})
            said.append((first.comment.line, _tool_text(first)))
    return tools, said, remarks


def _other_keys(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Whether two tools contradict each other in a key that both state."""
    return any(
        one[key] != other[key] if isinstance(one[key], str) else abs(one[key] - other[key]) > SAME_MM
        for key in set(one) & set(other)
    )


def _tool_text(tool: StatedTool) -> str:
    return f"line {tool.comment.line}: T{tool.number} {_cutter_words(tool.keys)} ({tool.reader})"


def _cutter_words(keys: Mapping[str, Any]) -> str:
    words = [f"{keys.get('type', 'flat')}", f"{keys['diameter_mm']:g} mm" if "diameter_mm" in keys else ""]
    more = [
        ("corner radius", "corner_radius_mm", "mm"),
        ("point", "point_deg", "deg"),
        ("flutes", "flute_length_mm", "mm"),
    ]
    texts = [f"{name} {keys[key]:g} {unit}" for name, key, unit in more if key in keys]
    return ", ".join([" ".join(filter(None, words)), *texts])


def _material_text(material: StatedMaterial) -> str:
    return f"line {material.comment.line}: material {material.name} ({material.reader})"


def _contradicting_materials(stated: Stated) -> list[str]:
    named = {each.name.lower(): _material_text(each) for each in stated.materials}
    return [" contradicts ".join([*named.values()][:2])] if len(named) > 1 else []


def _stock_text(stock: StatedStock) -> str:
    return f"line {stock.comment.line}: stock {_words(_as_spec(stock.keys))} ({stock.reader})"


def _as_spec(keys: dict[str, Any]) -> BoxStock | CylinderStock:
    return BoxStock(**keys) if keys["type"] == "box" else CylinderStock(**keys)


def _lengths(stock: Stock) -> Iterator[float]:
    for value in stock.model_dump(exclude={"type", "resolution_mm", "source"}).values():
        yield from value if isinstance(value, list) else [value]


def _differ(one: Stock, other: Stock) -> bool:
    if one.type != other.type:
        return other.type in ("box", "cylinder")
    return any(abs(a - b) > SAME_MM for a, b in zip(_lengths(one), _lengths(other), strict=True))


def _words(stock: Stock) -> str:
    match stock:
        case BoxStock():
            return f"box {_triple(stock.min_mm)} to {_triple(stock.max_mm)} mm"
        case CylinderStock():
            span = f"Z {stock.bottom_mm:g} to {stock.top_mm:g} mm"
            return f"cylinder of diameter {stock.diameter_mm:g} mm at {_triple(stock.centre_mm)}, {span}"
        case _:
            return stock.type


def _triple(values: list[float]) -> str:
    return "[" + ", ".join(f"{each + 0.0:g}" for each in values) + "]"
