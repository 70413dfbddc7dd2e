"""Plain milling programs for Sinumerik as people write them: read to the points worked out by hand, or refused for a true reason."""

import math

import pytest

from camcomp.gcode.flatten import flatten
from camcomp.gcode.interpret import read_program
from camcomp.gcode.output import Output
from camcomp.gcode.rewrite import rewrite
from camcomp.ground.errors import ProgramError
from tests.commandline import camcomp

# Program and the end points (mm) of its motions.
READ = {
    "contour": (
        ("; contour\nN10 G17 G90 G54 G71\nN20 T1 D1\nN30 M6\nN40 S3000 M3\nN50 G0 X-10 Y0 Z50\nN60 G1 Z-2 F200\nN70 X50 F600\n"
        "N80 G3 X60 Y10 CR=10\nN90 G1 Y40\nN100 G3 X50 Y50 I-10 J0\nN110 G0 Z50\nN120 M30\n"),
        [(-10, 0, 50), (-10, 0, -2), (50, 0, -2), (60, 10, -2), (60, 40, -2), (50, 50, -2), (50, 50, 50)],
    ),
    "header": (
        ('%_N_PLATTE_MPF\n;$PATH=/_N_WKS_DIR/_N_TEST_WPD\nN10 MSG("Platte; Teil 1")\nN20 G17 G90 G94 G54 G64\nN30 T="FRAESER_10" D1\n'
        "N40 M6\nN50 S5000 M3 F1000\nN60 G0 X0 Y0 Z100\nN70 Z5 M8\nN80 G1 Z=-3\nN90 G1 X=100 Y=IC(20)\nN100 G0 Z100 M9\nN110 M30\n"),
        [(0, 0, 100), (0, 0, 5), (0, 0, -3), (100, 20, -3), (100, 20, 100)],
    ),
    "absolute centres": (
        "G17 G90 G54\nT1 D1 M6\nS2000 M3\nG0 X0 Y0 Z-1\nG2 X20 Y0 I=AC(10) J=AC(0) F100\nG3 X40 Y0 I10 J0\nG2 X40 Y0 I10 J0\nM30\n",
        [(0, 0, -1), (20, 0, -1), (40, 0, -1), (40, 0, -1)],
    ),
    "plane xz": ("G18 G90 G54\nG0 X0 Y0 Z0\nS100 M4\nG1 X10 F500\nG2 X20 Z-10 I0 K-10\nG17\nM30\n", [(0, 0, 0), (10, 0, 0), (20, 0, -10)]),
    "smooth": (
        "G54 G17 G90 G641 ADIS=0.1 ADISPOS=0.5\nSOFT\nFFWON\nCOMPCAD\nG0 X0 Y0 Z5\nG1 Z-1 F500 S4000 M3\nX10 Y1\nX20 Y0\nCOMPOF\nM30\n",
        [(0, 0, 5), (0, 0, -1), (10, 1, -1), (20, 0, -1)],
    ),
    "cycle832": (
        ('N10 G90 G17 G40 G60 G54\nN20 CYCLE832(0.01,_ORI_FINISH,0.1)\nN30 T="KUGEL_6"\nN40 M6\nN50 S12000 M3\nN60 D1\nN70 G0 X0 Y0\n'
        "N80 G0 Z10\nN90 G1 Z0 F3000\nN100 X1.001 Y.5 Z-.123\nN120 CYCLE832()\nN140 M30\n"),
        [(0, 0, 0), (0, 0, 10), (0, 0, 0), (1.001, 0.5, -0.123)],
    ),
    "r parameters": (
        "R1=10 R2=5\nR3=R1*2+R2\nG17 G90 G54\nG0 X0 Y0 Z5\nG1 Z-1 F=R1*20\nX=R3\nR1=R1+1\nX=R1 Y=R2/2\nG0 Z=R1+SIN(30)\nM30\n",
        [(0, 0, 5), (0, 0, -1), (25, 0, -1), (11, 2.5, -1), (11, 2.5, 11.5)],
    ),
    "count": ("R1=0\nG17 G90 G71\nG0 X0 Y0 Z5\nR1=R1+1\nG1 X=R1 F100\nR1=R1+1\nX=R1\nM30\n", [(0, 0, 5), (1, 0, 5), (2, 0, 5)]),
    "incremental": (
        "G17 G54 G91\nG0 G90 X0 Y0 Z5\nG91 G1 Z-6 F100\nX10\nY10\nX-10\nG90 G0 Z50\nM30\n",
        [(0, 0, 5), (0, 0, -1), (10, 0, -1), (10, 10, -1), (0, 10, -1), (0, 10, 50)],
    ),
    "mixed absolute": (
        "G17 G91 G54 G94\nG90 G0 X0 Y0 Z5\nG91\nG1 X=AC(10) Y5 Z=IC(-6) F100\nG2 X10 Y0 I=AC(15) J=AC(5)\nG0 Z=AC(50)\nM30\n",
        [(0, 0, 5), (10, 5, -1), (20, 5, -1), (20, 5, 50)],
    ),
    "machine axes": (
        "N1 G17 G90 G54 G0 SUPA Z0 D0\nN2 T5\nN3 M6\nN4 D1\nN6 G0 X0 Y0\nN7 G0 Z3\nN8 G1 Z-3 F50\nN9 X30\nN11 SUPA G0 Z0 D0\nN13 M30\n",
        [(0, 0, 0), (0, 0, 0), (0, 0, 3), (0, 0, -3), (30, 0, -3), (30, 0, 0)],
    ),
    "fixed point": ("G17 G90\nG0 X0 Y0 Z5\nG1 X5 F100\nG75 FP=1 Z1=0\nG74 X1=0 Y1=0\nM30\n", [(0, 0, 5), (5, 0, 5), (5, 0, 0), (0, 0, 0)]),
    "dwell": ("G17 G90 S1000 M3\nG0 X0 Y0 Z5\nG4 F2\nG1 Z-1 F100\nG4 S30\nG0 Z5\nM30\n", [(0, 0, 5), (0, 0, -1), (0, 0, 5)]),
    "exact stops": (
        "G17 G90 G500\nG0 X0 Y0 Z5\nG1 Z0 F100\nG9 X10\nG64\nX20\nG602 G60 Y10\nX0\nM30\n",
        [(0, 0, 5), (0, 0, 0), (10, 0, 0), (20, 0, 0), (20, 10, 0), (0, 10, 0)],
    ),
    "frames off": (
        ('N10 TRAFOOF\nN20 CYCLE800()\nN30 G17 G54 G90\nN40 WORKPIECE(,"",,"BOX",112,0,-20,-80,0,0,100,100)\nN50 GROUP_BEGIN(0,"a",0,0)\n'
        'N60 T="F10" D1 M6\nN70 TRANS\nN80 ROT\nN90 G0 X0 Y0 Z10\nN100 G1 Z-1 F100\nN110 GROUP_END(0,0)\nN130 M30\n'),
        [(0, 0, 10), (0, 0, -1)],
    ),
    "end by M17": (
        'N30 G17 G90 G54 G0 X0 Y0 Z5\nN50 G1 X10 F100 ; (note) "quoted; text"\nN60 STOPRE\nN70 G1 Y10 M8\nN80 M1\nN90 M17\nN95 X99\n',
        [(0, 0, 5), (10, 0, 5), (10, 10, 5)],
    ),
    "many modes": (
        ("N5 G0 G53 Z0 D0\nN10 G54 G17 G90 G710 G94 CFC\nN15 T1 M6 D1\nN20 G97 S8000 M03 F=500\nN25 G00 X12.5 Y-7.25\nN30 Z3.\n"
        "N35 G01 Z-.5\nN40 X+20.25 Y-7.25 F1500\nN45 M05 M09\nN50 M30\n"),
        [(0, 0, 0), (12.5, -7.25, 0), (12.5, -7.25, 3), (12.5, -7.25, -0.5), (20.25, -7.25, -0.5)],
    ),
    "spindle one": ("G17 G90 G95\nS1=1000 M1=3 LIMS=3000\nG0 X0 Y0 Z5\nG1 Z-1 F0.1\nM30\n", [(0, 0, 5), (0, 0, -1)]),
    "tape number": (":10 G17 G90 G71\nN20 G0 X0 Y0 Z5\nN30 G1 X5 F100\nN40 M2\n", [(0, 0, 5), (5, 0, 5)]),
}  # fmt: skip
# A line, and the rule and the words of the message that say why it is not followed.
REFUSED = {
    "TRANS X10 Y10": ("CC118", "moves the coordinates"),
    "ATRANS Z-5": ("CC118", "moves the coordinates"),
    "ROT RPL=45": ("CC118", "turns the coordinates"),
    "AROT Z45": ("CC118", "turns the coordinates"),
    "SCALE X2": ("CC117", "scales or mirrors"),
    "AMIRROR X0": ("CC117", "scales or mirrors"),
    "REPEAT A B P=3": ("CC124", "jumps, loops"),
    "IF R1<3 GOTOB A": ("CC124", "jumps, loops"),
    "DEF REAL DEPTH=-2": ("CC124", "variables"),
    "L100 P2": ("CC125", "subprogram L100"),
    "CYCLE81(5,0,1,-10,)": ("CC132", "cycle of the control"),
    "POCKET3(5,0,1,-10,20,20,2,0,0,0,1)": ("CC132", "cycle of the control"),
    "MCALL CYCLE81(5,0,1,-10)": ("CC132", "cycle of the control"),
    "G111 X0 Y0": ("CC116", "polar"),
    "G1 RP=10 AP=0": ("CC116", "is not followed"),
    "CIP X20 Y0 I1=10 J1=10": ("CC112", "arc in a form"),
    "G2 X1 Y1 AR=90": ("CC112", "is not followed"),
    "BSPLINE X20 Y0": ("CC119", "spline"),
    "G41 G1 X0 Y0": ("CC114", "cutter radius"),
    "G1 X10 CHF=2": ("CC139", "is not followed"),
    "G1 X10 RND=2": ("CC139", "is not followed"),
    "G1 X10 FB=50": ("CC110", "is not followed"),
    "G331 Z-10 K1": ("CC120", "tapping"),
    "G63 Z-10": ("CC120", "tapping"),
    "G58 X5": ("CC129", "offset on top"),
    "G25 X0": ("CC106", "limit of the working area"),
    "G147 X5": ("CC114", "soft approach"),
    "G1 G247 DISR=2": ("CC114", "is not followed"),
    "G1 X1=5": ("CC115", "axis of the machine"),
    "G75 FP=2 X0": ("CC129", "position 2 of G75"),
    "G28 X0": ("CC106", "not a code"),
    "R1=2 R2=R1": ("CC123", "set and used"),
    "G1 X=R9": ("CC123", "R9 has no value"),
    "D0\nG1 X5": ("CC133", "D0"),
    "G2 X1 Y0 I.5 P2": ("CC109", "P is not used"),
}


def read(text, name="in.mpf", dialect=None):
    return read_program(text.encode(), name=name, dialect=dialect)


@pytest.mark.parametrize("name", READ)
def test_a_plain_program_is_read(name):
    text, ends = READ[name]
    program = read(text)
    assert program.dialect == "sinumerik"
    assert program.path.end.tolist() == [pytest.approx(each) for each in ends]


@pytest.mark.parametrize("line", REFUSED)
def test_what_is_not_followed_is_refused_for_a_true_reason(line):
    rule, words = REFUSED[line]
    with pytest.raises(ProgramError) as caught:
        read(f"G17 G90 G54 G71\nT1 D1 M6\nG0 X0 Y0 Z5 F100\n{line}\nM30\n")
    assert caught.value.rule == rule and words in str(caught.value)
    assert caught.value.at.line >= 4 and caught.value.hint


@pytest.mark.parametrize(
    ("codes", "end", "feed"),
    [("G70", 25.4, 300), ("G700", 25.4, 300 * 25.4), ("G71", 1, 300), ("G710", 1, 300)],
)
def test_feeds_change_their_unit_with_g700_alone(codes, end, feed):
    path = read(f"G17 G90 {codes}\nG0 X0 Y0 Z1\nG1 X1 F300\nM30\n").path
    assert path.end[1, 0] == pytest.approx(end) and path.feed[1] == pytest.approx(feed)


@pytest.mark.parametrize("codes", ["G70", "G700"])
def test_a_feed_is_written_in_the_unit_in_which_it_is_read(codes):
    program = read(f"G17 G90 {codes}\nG0 X0 Y0 Z1\nG1 X1 F300\nX2\nM30\n")
    same = Output.same(program.path)
    feed = program.path.feed * 1.5
    out = Output(
        motion=same.motion,
        kind=same.kind,
        end=same.end + 0.1,
        centre=same.centre,
        angle=same.angle,
        feed=feed,
        joining=same.joining,
    )
    again = read(rewrite(program, out, resolution_mm=1e-4, version="1").data.decode())
    assert again.path.feed[1:] == pytest.approx(feed[1:])


def test_units_tell_the_language_of_a_file_of_any_name():
    assert read("G17 G90 G71 G94\nG0 X0 Y0 Z5\nG1 X5 F100\nM30\n", "in.nc").dialect == "sinumerik"
    assert read("N10 G70 G90 F100 S500 M3\nN20 G0 X0 Y0 Z5\nM30\n", "in.nc").path.end[0, 2] == 127
    assert read("G17 G90\nG0 X0 Y0 Z5\nM30\n", "in.SPF").dialect == "sinumerik"
    with pytest.raises(ProgramError) as caught:  # a lathe cycle
        read("G21 G90\nG0 X50 Z5\nG71 P10 Q20 U1 W1 F0.2\nM30\n", "in.nc")
    assert caught.value.rule in ("CC122", "CC106") and "sinumerik" in caught.value.hint + str(caught.value) + "dialect"


def test_turn_counts_full_circles_and_radius_takes_the_longer_arc_by_its_sign():
    path = read("G17 G90\nG0 X20 Y0 Z0\nG3 X20 Y0 Z-6 I-20 J0 TURN=2 F100\nG3 X40 Y0 CR=-12\nM30\n").path
    assert path.angle[1] == pytest.approx(6 * math.pi)
    assert path.angle[2] == pytest.approx(2 * math.pi - 2 * math.asin(10 / 12))


def test_the_rounding_distance_bounds_how_far_a_corner_is_cut():
    modes = read("G17 G90 G641 ADIS=0.25\nG0 X0 Y0 Z0\nG1 X1 F100\nG60\nX2\nG9 X3\nG64\nX4\nM30\n").modes
    assert [mode.said(1.0) for mode in modes] == ["G641 ADIS=0.25", "G641 ADIS=0.25", "G60", "G60", "G64"]
    assert [mode.exact for mode in modes] == [False, False, True, True, False] and modes[0].tolerance_mm == 0.25


def test_g9_stops_behind_its_own_block():
    assert read("G17 G90 G64\nG0 X0 Y0 Z0\nG1 X1 F100\nG9 X2\nX3\nX4\nM30\n").path.waits.tolist() == [
        False,
        False,
        False,
        True,
        False,
    ]


@pytest.mark.parametrize("name", ["r parameters", "count", "mixed absolute", "absolute centres"])
def test_what_is_computed_is_written_out(name):
    program = read(READ[name][0])
    flat = flatten(program, 1e-3)
    assert flat.path.end.tolist() == [pytest.approx(each, abs=1e-6) for each in program.path.end.tolist()]


def test_a_program_is_compensated_in_its_own_language(tmp_path):
    (tmp_path / "in.mpf").write_text(READ["contour"][0])
    done = camcomp("compensate", tmp_path / "in.mpf", "--config", "config/cartesian.yaml", "-o", tmp_path / "out.mpf")
    assert done.returncode == 0, done.stderr
    out = (tmp_path / "out.mpf").read_text()
    assert out.splitlines()[0].startswith(";camcomp") and "N10 G17 G90 G54 G71" in out
    assert read(out, "out.mpf").dialect == "sinumerik"
