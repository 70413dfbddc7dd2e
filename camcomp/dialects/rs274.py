"""LinuxCNC and its ancestor RS274/NGC: the reference; read like LinuxCNC 2.9 does."""

from camcomp.gcode.dialect import Dialect
from camcomp.gcode.spelling import RS274

DIALECT = Dialect(
    name="rs274",
    title="LinuxCNC, RS274/NGC",
    marks=(
        (r"^[ \t]*+(n\d+[ \t]*+)?o[ \t]*+(<[^>\n]{1,80}>|\d+)[ \t]*+(sub|call|if|while|do|repeat|endsub|return)\b", 10),
        (r"#[ \t]*+<[^>\n]{1,80}>", 10),
        (r"^[^(;\n]*\bg[ \t]*+(59\.[123]|90\.1|91\.1|43\.1|61\.1|92\.[123]|28\.1|30\.1)(?!\d)", 6),
        (r"^[^(;\n]*\bg64[ \t]*+p", 4),
        (r"\((debug|msg|print|log|probeopen|axis)[ \t]*+,", 4),
        (r"linuxcnc|emc2|rs274", 6),
    ),
    spelling=RS274,
    flow="o-words",
    more={740: 1},
    retract_to_start=False,
    merges=True,
)
