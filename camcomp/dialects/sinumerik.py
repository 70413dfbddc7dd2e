"""Siemens Sinumerik 840D milling: `CR=`, `I=AC()`, `X=IC()`, R parameters; no jumps, frames and standard cycles."""

from camcomp.gcode.dialect import Dialect
from camcomp.gcode.spelling import SINUMERIK

_SETTABLE = {5000: "G500", **{10 * number: f"G{number}" for number in range(505, 600)}}

DIALECT = Dialect(
    name="sinumerik",
    title="Siemens Sinumerik",
    marks=(
        (r"^%_N_\w+_(MPF|SPF)", 10),
        (r"^;\$PATH=", 8),
        (r"^[^;(\n]*\b(CR|TURN|AR)[ \t]*+=", 8),
        (r"^[^;(\n]*=[ \t]*+(AC|IC)[ \t]*+\(", 8),
        (r"^[^;(\n]*\b(CYCLE\d{2,3}|POCKET\d|HOLES\d)\b", 6),
        (r"^[^;(\n]*\b(MSG|WORKPIECE)[ \t]*+\(", 5),
        (r"^[^;(\n]*\bT[ \t]*+=[ \t]*+\"", 6),
        (r"^[^;(\n]*\b(G500|TRANS|ATRANS|SUPA|TRAFOOF|STOPRE|MCALL|GOTOF|GOTOB)\b", 4),
        (r"^[^;(\n]*\bR\d+[ \t]*+=", 4),
    ),
    spelling=SINUMERIK,
    flow="sinumerik",
    more={
        700: 6,
        710: 6,
        7000: 6,
        7100: 6,
        **dict.fromkeys((4500, 4510), 18),
        740: 0,
        750: 0,
        1530: 0,
        **dict.fromkeys(_SETTABLE, 12),
        **dict.fromkeys((90, 600, 6010, 6020, 6030, 6410, 6420, 6430, 6440, 6450), 13),
    },
    without=frozenset((100, 200, 210, 280, 300, 281, 301, 520, 920, 921, 922, 923, 980, 990, 901, 911, 431, 430, 490))
    | frozenset((591, 592, 593, 580, 590, 610, 611, 730, 810, 820, 830, 840, 850, 860, 870, 880, 890, 800)),
    more_offsets=_SETTABLE,
    writes_turns=False,
    dwell="FS",
    idle_letters="DNHT",
    brackets_comment=False,
    comment=(";", ""),
    decimals_max=6,
)
