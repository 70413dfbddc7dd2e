"""Siemens Sinumerik 840D milling: `CR=`, `I=AC()`, `X=IC()`, R parameters; no jumps, frames and standard cycles."""

from camcomp.gcode.codes import EXACT_STOP_ONCE
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
        # G70, G71, G700, G710 as units: no words of a lathe cycle are with them.
        (r"^(?=[^;(\n]*G7(?:[01]|00|10)(?![\d.]))(?:[ \t]*+[NGFSTMD][ \t]*+\d++\.?+\d*+)++[ \t]*+(?:;.*)?$", 4),
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
        **dict.fromkeys((600, 6410, 6420, 6430, 6440, 6450), 13),
        **dict.fromkeys((6010, 6020, 6030), 20),  # when a position counts as reached
        90: EXACT_STOP_ONCE,
    },
    reasons={
        **dict.fromkeys(
            (250, 260), ("CC106", "a limit of the working area or of the spindle, which camcomp does not follow")
        ),
        **dict.fromkeys((630, 3310, 3320), ("CC120", "tapping, which follows the spindle")),
        **dict.fromkeys((340, 350), ("CC120", "threading, which follows the spindle")),
        **dict.fromkeys((580, 590), ("CC129", "an offset on top of the settable one, which camcomp does not follow")),
        **dict.fromkeys((1100, 1110, 1120), ("CC116", "the pole of polar coordinates")),
        **dict.fromkeys(
            (1400, 1410, 1420, 1430, 1470, 1480, 2470, 2480, 3400, 3410, 3470, 3480),
            ("CC114", "a soft approach or retraction, whose path depends on the cutter radius"),
        ),
        2910: ("CC127", "the switch to ISO dialect; post for one language"),
    },
    ends=frozenset((2, 17, 30)),
    endings=(".mpf", ".spf"),
    exact_stop="G60",
    without=frozenset(
        (
            70,
            80,
            150,
            160,
            310,
            380,
            382,
            383,
            384,
            385,
            500,
            510,
            511,
            681,
            682,
            683,
            690,
            691,
            434,
            435,
            711,
            712,
            720,
            721,
            722,
        )
    )
    | frozenset((100, 200, 210, 280, 300, 281, 301, 520, 920, 921, 922, 923, 980, 990, 901, 911, 431, 430, 490))
    | frozenset((591, 592, 593, 610, 611, 730, 810, 820, 830, 840, 850, 860, 870, 880, 890, 800)),
    more_offsets=_SETTABLE,
    turns=False,  # TURN does, and is another word
    writes_turns=False,
    numbered_homes=frozenset(((75, "FP"),)),
    dwell="FS",
    idle_letters="DNHT",
    brackets_comment=False,
    comment=(";", ""),
    decimals_max=6,
)
