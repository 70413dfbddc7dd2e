"""Check whether an unreadable text is meant as an NC program."""

import re

LINES = 400  # examined lines
SHARE = 0.2  # least share of NC lines among them in a program with errors

# Words such as G1, X-2.5, X=#101, N10, or the statements, calls, comments and percent signs around them.
_LINE = re.compile(
    rb"\s*(?:%|[(;#/<]|O\s*[\d<]|[GMNTXYZ]\s*[-+=#.\d\[]|[ABCFSIJKR]\s*[-+.]?\d|(?:WHILE|IF|GOTO|END|PROC|DEF|EXTERN|CALL)\b)",
    re.IGNORECASE,
)
_WORD = re.compile(rb"[GMXYZ]\s*[-+=#.\d\[]", re.IGNORECASE)


def like_a_program(data: bytes) -> bool:
    """Whether at least SHARE of the lines start like NC lines, and one has a word of motion or a code."""
    lines = [line for line in data.splitlines()[:LINES] if line.strip()]
    alike = [line for line in lines if _LINE.match(line)]
    return b"\0" not in data[:4096] and len(alike) >= SHARE * len(lines) and any(_WORD.search(line) for line in alike)
