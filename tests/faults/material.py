"""Small inputs to be spoilt."""

from tests.commandline import ROOT

_CLEAR = ROOT / "samples" / "diagnosis" / "clear"
EXPERIMENT = {
    "experiment.yaml": b"config: [machine.yaml]\nholdout: [second]\nsd: {tip_mm: 0.001}\nruns:\n"
    b"  - {name: first, program: program-1.nc, log: log-1.csv, cutting: true, started_s: 10.0, clamping: one}\n"
    b"  - {name: second, program: program-2.nc, log: log-2.csv, cutting: true, started_s: 700.0, clamping: one}\n",
    **{name: (_CLEAR / name).read_bytes() for name in ("program-1.nc", "program-2.nc", "log-1.csv", "log-2.csv")},
}
POSES = b"".join((ROOT / "samples" / "ur10" / "series_A.csv").read_bytes().splitlines(keepends=True)[:40])
_LINK = """<link name="l{i}"><inertial><origin xyz="0 0 0.1"/><mass value="{m}"/></inertial></link>
<joint name="j{i}" type="revolute"><parent link="l{p}"/><child link="l{i}"/><origin xyz="0 {y} {z}" rpy="0 {r} 0"/>
<axis xyz="0 {a} {b}"/><limit lower="-3.1" upper="3.1" effort="1" velocity="1"/></joint>
"""
URDF = (
    '<?xml version="1.0" encoding="utf-8"?>\n<robot name="arm"><link name="l0"/>\n'
    + "".join(
        _LINK.format(i=i, p=i - 1, m=10 - i, y=0.1 * (i % 2), z=0.3, r=0.5 * (i % 3), a=i % 2, b=1 - i % 2)
        for i in range(1, 7)
    )
    + "</robot>\n"
).encode()
