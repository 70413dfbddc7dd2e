"""Whether a text that could not be read was meant as an NC program at all."""

import re

LINES = 400  # that are looked at
SHARE = 0.2  # of them, from which a text counts as a program with mistakes

# Words such as G1, X-2.5, X=#101, N10, or the statements, calls, comments and percent signs around them.
_LINE = re.compile(
    rb"\s*(?:%|[(;#/<]|O\s*[\d<]|[GMNTXYZ]\s*[-+=#.\d\[]|[ABCFSIJKR]\s*[-+.]?\d|(?:WHILE|IF|GOTO|END|PROC|DEF|EXTERN|CALL)\b)",
    re.IGNORECASE,
)
_WORD = re.compile(rb"[GMXYZ]\s*[-+=#.\d\[]", re.IGNORECASE)


def like_a_program(data: bytes) -> bool:
    """Whether a good part of the lines begin as those of programs do, and one of them holds a word that moves or switches."""
    lines = [line for line in data.splitlines()[:LINES] if line.strip()]
    alike = [line for line in lines if _LINE.match(line)]
    return b"\0" not in data[:4096] and len(alike) >= SHARE * len(lines) and any(_WORD.search(line) for line in alike)
