"""Fanuc 0i/30i milling and controls that follow it (Haas, Mitsubishi, Mazak EIA): custom macro B, M98/M99, G65."""

from camcomp.gcode.codes import EXACT_STOP_ONCE
from camcomp.gcode.dialect import Dialect
from camcomp.gcode.spelling import FANUC

DIALECT = Dialect(
    name="fanuc",
    title="Fanuc and controls like it (ISO)",
    marks=(
        (r"^[ \t]*+%?[ \t]*+[O:][ \t]*+\d{1,8}[ \t]*+(\(|$)", 5),
        (r"^[ \t]*+<[^>\n]+>[ \t]*+(\(|$)", 4),
        (r"^[^(;\n]*\bm[ \t]*+9[89]\b", 3),
        (r"^[^(;\n]*\bg[ \t]*+65\b", 6),
        (r"^[^(;\n]*\bg[ \t]*+54\.1[ \t]*+p", 8),
        (r"^[^(;\n]*\bg[ \t]*+0?5(\.1)?[ \t]*+[pq][ \t]*+\d", 6),
        (
            r"^[ \t]*+(n\d+[ \t]*+)?(if[ \t]*+\[.*\][ \t]*+(goto|then)|while[ \t]*+\[.*\][ \t]*+do[ \t]*+\d|goto[ \t]*+\d)",
            10,
        ),
        (r"^[^(;\n]*\bg[ \t]*+91[ \t]*+g[ \t]*+28\b|\bg[ \t]*+28[ \t]*+g[ \t]*+91\b", 2),
        (r"^[^(;\n]*\bg[ \t]*+0?0[ \t]*+(g[ \t]*+9[01][ \t]*+)?g[ \t]*+28\b", 6),
        (r"^[^(;\n]*\bg[ \t]*+43[ \t]*+(z[^ \n]{1,20} )?h[ \t]*+\d", 1),
    ),
    spelling=FANUC,
    flow="macro",
    more={541: 12, 650: 0, 740: 1, 760: 1, 90: EXACT_STOP_ONCE, 620: 13, 630: 13},
    reasons={
        70: ("CC106", "hypothetical axis interpolation, which camcomp does not follow"),
        **dict.fromkeys((120, 130, 1500), ("CC106", "a pocket cycle of Haas, which camcomp does not follow")),
        440: ("CC106", "a negative tool length offset, which camcomp does not follow"),
        **dict.fromkeys((450, 460, 470, 480), ("CC106", "a tool offset along the axes, which camcomp does not follow")),
        600: ("CC106", "positioning from one side, which camcomp does not follow"),
        **dict.fromkeys((660, 661), ("CC124", "a modal call, which camcomp does not follow")),
        **dict.fromkeys((700, 710, 720), ("CC106", "a pattern of holes on Haas, and no code of Fanuc milling")),
        **dict.fromkeys((721, 722), ("CC118", "a copy of a figure, turned or moved")),
        **dict.fromkeys((842, 843), ("CC120", "rigid tapping of the older format, which camcomp does not follow")),
    },
    without=frozenset((281, 301, 431, 901, 911, 591, 592, 593, 921, 922, 923, 611)),
    passed=frozenset((50, 51, 80, 110, 230, 670, 1130, 1870)),
    turns=False,
    writes_turns=False,
    increments=True,
    machine_moves_rapid=True,
    home_beside_motion=True,
    numbered_homes=frozenset(((30, ""),)),
    dwell="PXU",
    dwell_p_s=1e-3,
    modal_length=True,
    own_local_frame=True,
    extended_offsets=True,
    relative_offsets=True,
    repeats="KL",
    cycles_apart=True,
    peck_clearance_mm=1.0,
    decimals_max=4,
)
