"""Fanuc 0i/30i milling and controls that follow it (Haas, Mitsubishi, Mazak EIA): custom macro B, M98/M99, G65."""

from camcomp.gcode.dialect import Dialect
from camcomp.gcode.spelling import FANUC

DIALECT = Dialect(
    name="fanuc",
    title="Fanuc and alike (ISO)",
    marks=(
        (r"^\s*%?\s*[O:]\s*\d{1,8}\s*(\(|$)", 5),
        (r"^\s*<[^>\n]+>\s*(\(|$)", 4),
        (r"^[^(;\n]*\bm\s*9[89]\b", 3),
        (r"^[^(;\n]*\bg\s*65\b", 6),
        (r"^[^(;\n]*\bg\s*54\.1\s*p", 8),
        (r"^[^(;\n]*\bg\s*0?5(\.1)?\s*[pq]\s*\d", 6),
        (r"^\s*(n\d+\s*)?(if\s*\[.*\]\s*(goto|then)|while\s*\[.*\]\s*do\s*\d|goto\s*\d)", 10),
        (r"^[^(;\n]*\bg\s*91\s*g\s*28\b|\bg\s*28\s*g\s*91\b", 2),
        (r"^[^(;\n]*\bg\s*43\s*(z[^ ]+ )?h\s*\d", 1),
    ),
    spelling=FANUC,
    flow="macro",
    more={541: 12, 650: 0, 740: 1, 90: 0, 600: 13, 620: 13, 630: 13},
    without=frozenset((281, 301, 431, 901, 911, 591, 592, 593, 921, 922, 923, 611)),
    passed=frozenset((50, 51, 80, 110, 230, 670, 1130, 1870)),
    turns=False,
    writes_turns=False,
    increments=True,
    machine_moves_rapid=True,
    home_beside_motion=True,
    dwell="PXU",
    modal_length=True,
    own_local_frame=True,
    extended_offsets=True,
    relative_offsets=True,
    repeats="KL",
    peck_clearance_mm=1.0,
    decimals_max=4,
)
