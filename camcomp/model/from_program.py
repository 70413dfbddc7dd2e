"""Stock and tools from the comments of a program, for values that the machine file does not state."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from io import BytesIO
from typing import Any, BinaryIO, Literal

from camcomp.gcode.stated import Stated, StatedStock, read_stated
from camcomp.ground.errors import Location, ProgramError
from camcomp.model.config.cutting_tool import BoxStock, CommentsStock, Cutter, CylinderStock, ProgramStock, Stock
from camcomp.model.config.spec import Config
from camcomp.model.config.taken import TakenFromProgram
from camcomp.model.job import Job

StockChoice = Literal["none", "program", "comments"]
SAME_MM = 1e-3  # difference below which lengths are equal: posts write three decimals


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
        ProgramError: CC143, the stock is to come from comments that do not state it, or contradict each other.
    """
    if choice == "none":
        return _taking(job, TakenFromProgram(has_stock=True))
    stated = read_stated(BytesIO(source) if isinstance(source, bytes) else source)
    tools, said, remarks = _tools_of(job.config, stated)
    own = job.config.workpiece.stock
    if choice == "program":
        around = own if isinstance(own, ProgramStock) else ProgramStock(type="program")
        return _taking(job, TakenFromProgram(has_stock=True, stock=around, tools=tools, said=said, remarks=remarks))
    required = choice == "comments" or isinstance(own, CommentsStock)
    found, doubts = _stock_of(stated)
    if required and found is None:
        _refuse(name, stated, doubts)
    if not required:
        remarks += tuple(f"not taken from the program: {each}" for each in doubts)
    takes = found is not None and (required or own is None)
    if found is not None:
        text = f"line {found.comment.line}: stock {_words(_as_spec(found.keys))} ({found.reader})"
        if takes:
            said += (text,)
        elif own is not None and _differ(_as_spec(found.keys), own):
            remarks += (f"{text} contradicts workpiece: stock {_words(own)}, which counts",)
    said += tuple(f"line {each.comment.line}: material {each.name} ({each.reader})" for each in stated.materials)
    stock = _as_spec(found.keys) if found is not None and takes else None
    return _taking(job, TakenFromProgram(has_stock=takes, stock=stock, tools=tools, said=said, remarks=remarks))


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


def _stock_of(stated: Stated) -> tuple[StatedStock | None, list[str]]:
    """Stock on which all comments agree, and reasons to doubt it."""
    doubts = [f"line {each.comment.line}: {each.reader}: {each.why}" for each in stated.doubts]
    if not stated.stocks:
        return None, doubts
    first, *others = stated.stocks
    line = f"line {first.comment.line}: {first.reader}"
    if any(_differ(_as_spec(first.keys), _as_spec(each.keys)) for each in others):
        return None, [f"{line}: another comment states another stock", *doubts]
    if other := sorted(stated.offsets - {"G54"}):
        return None, [f"{line}: the stock's place is that of a work offset, and the program uses {other[0]}", *doubts]
    return first, doubts


def _tools_of(config: Config, stated: Stated) -> tuple[dict[int, Cutter], tuple[str, ...], tuple[str, ...]]:
    """Tools that the config does not state, texts of the values read, and contradictions."""
    tools: dict[int, Cutter] = {}
    said, remarks = list[str](), list[str]()
    for each in stated.tools:
        own = Cutter.model_validate({"teeth": config.tool.teeth, **each.keys})
        here = f"line {each.comment.line}: T{each.number} {own.type} {own.diameter_mm:g} mm ({each.reader})"
        known: Cutter = tools.get(each.number) or config.tools.get(each.number) or config.tool
        if known.diameter_mm is None:
            tools[each.number] = own
            said.append(here)
        elif abs(known.diameter_mm - (own.diameter_mm or 0.0)) > SAME_MM or known.type not in (None, own.type):
            key = f"tools: {each.number}" if each.number in config.tools else "tool"
            remarks.append(f"{here} contradicts {key}: {known.type or 'flat'} {known.diameter_mm:g} mm, which counts")
    return tools, tuple(said), tuple(dict.fromkeys(remarks))


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
    return "[" + ", ".join(f"{each:g}" for each in values) + "]"
