"""Stock and tools in comments: what public posts write, and where the block then lies."""

from io import BytesIO

import pytest

from camcomp.gcode.stated import read_stated
from camcomp.ground import shelf


def stated(text):
    return read_stated(BytesIO(text.encode()))


def corners(text):
    (stock,) = stated(text).stocks
    return stock.keys["min_mm"], stock.keys["max_mm"]


def doubts(text):
    found = stated(text)
    assert not found.stocks
    return [(each.comment.line, each.why) for each in found.doubts]


@pytest.mark.parametrize("name", shelf.members("comments"))
def test_every_reader_keeps_to_the_contract_for_users(name):
    from camcomp.plugins.comments import checked

    assert checked(name, shelf.load("comments", name), name).TITLE


def test_linuxcnc_box_has_its_corners_in_the_unit_in_force():
    box = "(WORKPIECE,BOX,XMIN=0,YMIN=-1,ZMIN=-40,XMAX=100,YMAX=50,ZMAX=0)\n"
    assert corners("G21\n" + box) == ([0, -1, -40], [100, 50, 0])
    assert corners("G20\n" + box) == ([0, -25.4, -1016], [2540, 1270, 0])
    assert corners(box + "G20\n") == ([0, -25.4, -1016], [2540, 1270, 0])
    assert corners("G20\nG1 X1\nG21\n" + box) == ([0, -1, -40], [100, 50, 0])


def test_a_unit_code_in_a_comment_is_no_code():
    assert corners("(G20)\n(WORKPIECE,BOX,XMIN=0,YMIN=0,ZMIN=-4,XMAX=1,YMAX=1,ZMAX=0)\n")[1] == [1, 1, 0]


def test_linuxcnc_cylinder_stands_on_its_centre():
    (stock,) = stated("(workpiece,cylinder,axis=z,x=5,y=-2,zmin=-40,zmax=1,diameter=80)\n").stocks
    assert stock.keys == {"type": "cylinder", "diameter_mm": 80, "centre_mm": [5, -2], "bottom_mm": -40, "top_mm": 1}


@pytest.mark.parametrize(
    ("comment", "why"),
    [
        ("WORKPIECE,TUBE,AXIS=Z,X=0,Y=0,ZMIN=-4,ZMAX=0,DIAMETER=8,INNER_DIAMETER=4", "TUBE"),
        ("WORKPIECE,CYLINDER,AXIS=X,Y=0,Z=0,XMIN=-4,XMAX=0,DIAMETER=8", "CYLINDER along X"),
        ("WORKPIECE,BOX,XMIN=0,YMIN=0,ZMIN=-4,XMAX=8,YMAX=8", "ZMAX is missing"),
        ("WORKPIECE,BOX,XMIN=0,YMIN=0,ZMIN=4,XMAX=8,YMAX=8,ZMAX=0", "no room"),
        ("WORKPIECE,BOX,XMIN=nan,YMIN=0,ZMIN=-4,XMAX=8,YMAX=8,ZMAX=0", "nan is no length"),
        ("STOCK/BLOCK,100,50,10", "place of the block is not stated"),
        ("STOCK/BLOCK,100,50,10,-5,0,10", "zero lies outside"),
        ("STOCK/CYLINDER,80,40,0,0,0", "cannot be followed"),
        ("@FC|STOCK|id=box|width=150|depth=100|height=10", "ORIGIN"),
        ("@FC|STOCK|id=mesh|width=150", "'mesh' cannot be followed"),
    ],
)
def test_what_is_not_certain_is_a_doubt_and_no_stock(comment, why):
    ((line, said),) = doubts(f"G21\n({comment})\n")
    assert line == 2 and why in said


# Lines as Carbide Create, gcodepreview, OpenVoronoi and the Makera post write them.
def test_cutviewer_block_begins_at_minus_its_origin():
    assert corners(
        "(stockMin:0.00mm, 0.00mm, -1.00mm)\n(stockMax:100.00mm, 100.00mm, 0.00mm)\n"
        "(STOCK/BLOCK,100.00, 100.00, 1.00,0.00, 0.00, 1.00)\nG90\nG21\n"
    ) == ([0, 0, -1], [100, 100, 0])
    assert corners("( STOCK/BLOCK,300.0000,200.0000,10.0000,150.0000,100.0000,5.0000 ) \n") == (
        [-150, -100, -5],
        [150, 100, 5],
    )


def test_cutviewer_block_that_its_corners_contradict_is_a_doubt():
    text = "(stockMin:0mm,0mm,-2mm)\n(stockMax:100mm,100mm,0mm)\n(STOCK/BLOCK,100,100,1,0,0,1)\n"
    assert doubts(text) == [(3, "stockMin and stockMax state another block")]


@pytest.mark.parametrize("style", ["({})", ";{}"])
def test_freecad_origin_is_seen_from_the_middle_of_the_stock(style):
    lines = ["@FC|STOCK|id=box|width=150|depth=100|height=10", "@FC|ORIGIN|type_name=topFrontLeft|x=-75|y=-50|z=5"]
    assert corners("\n".join(style.format(each) for each in lines)) == ([0, 0, -10], [150, 100, 0])


def test_freecad_bar_that_lies_down_is_a_doubt():
    text = "(@FC|STOCK|id=cylinder|width=100|depth=40|height=40|diameter=40)\n(@FC|ORIGIN|x=0|y=0|z=0)\n"
    assert "stand along Z" in doubts(text)[0][1]


@pytest.mark.parametrize(
    ("text", "number", "keys"),
    [
        ("(TOOL/MILL,3.17, 0.00, 0.00, 0.00)\nM6T102\n", 102, {"diameter_mm": 3.17, "type": "flat"}),
        ("(TOOL/MILL,6, 3, 20, 0)\nT4 M6\n", 4, {"diameter_mm": 6, "type": "ball", "flute_length_mm": 20}),
        ("(TOOL/DRILL,5,118)\nT2\n", 2, {"diameter_mm": 5, "type": "drill", "point_deg": 118}),
        ("(T7 D=10. CR=1. - ZMIN=-5. - bull nose end mill)\n", 7,
         {"diameter_mm": 10, "type": "bull", "corner_radius_mm": 1}),
        ("G20\n(T1  D=0.25 CR=0. - ZMIN=-0.5 - flat end mill)\n", 1, {"diameter_mm": 6.35, "type": "flat"}),
        ("(@FC|TOOL|number=5|name=Drill|type=Drill|diameter=3|tipangle=118)\n", 5,
         {"diameter_mm": 3, "type": "drill", "point_deg": 118}),
        ("(T1 : End Mill {6 mm})\n", 1, {"diameter_mm": 6, "type": "flat"}),
        ("G21\n(Ball Nose (0.25 inch))\nT3M6\n", 3, {"diameter_mm": 6.35, "type": "ball"}),
        ("G21\nT5 M6\n(Tool: End Mill {6 mm})\nG0 Z5\nG1 X1\nX2\nX3\nX4\nX5\nT6 M6\n", 5, {"diameter_mm": 6, "type": "flat"}),
        ("G21\n(Tool: End Mill {6 mm})\nG1 X1\n", 0, {"diameter_mm": 6, "type": "flat"}),
        ("G20\n(T1|1/4 FLAT ENDMILL|H1|D1|TOOL DIA. - .25)\n", 1, {"diameter_mm": 6.35, "type": "flat"}),
        ("G21\n( 6. BALL ENDMILL TOOL - 2 DIA. OFF. - 2 LEN. - 2 DIA. - 6.)\n", 2, {"diameter_mm": 6, "type": "ball"}),
        ("G21\nT1\nM5\nG04 P1.0\n(MSG, Change tool bit to drill size 0.8mm)\nM6\n", 1, {"diameter_mm": 0.8, "type": "drill"}),
        ("G21\n(T02 D=5 CR=0 - ZMIN=-1.125 - FLAT END MILL - L=1.0/4.0)\n", 2, {"diameter_mm": 5, "type": "flat"}),
    ],
)  # fmt: skip
def test_tools(text, number, keys):
    (tool,) = stated(text).tools
    assert (tool.number, tool.keys) == (number, keys)


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        (
            "(T4 D=8. CR=1. - ZMIN=-5. - bullnose end mill)",
            {"diameter_mm": 8.0, "type": "bull", "corner_radius_mm": 1.0},
        ),
        ("(T5 D=5. CR=0. TAPER=118deg - ZMIN=-12. - drill)", {"diameter_mm": 5.0, "type": "drill", "point_deg": 118.0}),
        ("G20\n(T6 : End Mill {1/4 inch})", {"diameter_mm": 6.35, "type": "flat"}),
    ],
)
def test_more_tools(text, keys):
    (tool,) = stated(text).tools
    assert tool.keys == keys


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("(TOOL/MILL,6,4,20,0)\nT1", "does not fit"),
        ("(TOOL/MILL,6,0,20,5)\nT1", "tapered"),
        ("(T9 D=6,5 CR=0, - ZMIN=-5, - flat end mill)", "'6,5' is no number"),
        ("(@FC|TOOL|number=1.5|type=endmill|diameter=6)", "no tool number"),
        ("(T1 D=6. CR=1. - ZMIN=-5. - flat end mill)", "corner radius of 1"),
        ("(T2  D=0.25 CR=0. - ZMIN=-0.0311 - 1-4 FLAT)", "type of the tool is not stated"),
        ("(Tapered Ball Nose {3 mm})", "taper"),
        ("T1 M6\n(End Mill {3 mm})\nT2 M6", "number of the tool is open"),
        ("(T15|3 FACE MILL / SHELL MILL|H15|D15|TOOL DIA. - 3.25)", "form of '3 FACE MILL / SHELL MILL' is open"),
        ("(T1|.25 SPOT DRILL|H1|D1|TOOL DIA. - .25)", "is open"),
        ("T1\n(MSG, Change tool bit to mill diameter 0.1mm)", "engraving mill is open"),
        ("(@FC|TOOL|number=2|type=bullnose|diameter=6|cornerRadius=5)", "does not fit"),
    ],
)
def test_tools_that_cannot_be_are_doubts(text, why):
    found = stated(text)
    assert not found.tools
    assert [why in each.why for each in found.doubts] == [True]


def test_programs_without_marks_state_nothing():
    assert stated("(STOCKTAKING)\n(pocket D 6)\nG1 X1 T1\n") == stated("")


BOX = "(WORKPIECE,BOX,XMIN=0,YMIN=0,ZMIN=-4,XMAX=8,YMAX=8,ZMAX=0)\n"


@pytest.mark.parametrize(
    ("text", "bad", "stocks", "tools"),
    [
        (BOX.replace("-4", "x") + BOX, [1], 1, []),
        ("(T1 D=6,5 CR=0. - ZMIN=-5. - flat end mill)\n(T2 D=4. CR=0. - ZMIN=-5. - flat end mill)\n", [1], 0, [2]),
        ("(TOOL/MILL,x,0,0,0)\nT1 M6\n(TOOL/MILL,4,0,0,0)\nT2 M6\n", [1], 0, [2]),
        (("(@FC|TOOL|number=1|type=endmill|diameter=)\n(@FC|TOOL|number=2|type=endmill|diameter=4)\n"
         "(@FC|STOCK|id=box|width=8|depth=8|height=4)\n(@FC|ORIGIN|x=-4|y=-4|z=2)\n"), [1], 1, [2]),
        ("(@FC|TOOL|number=2|type=endmill|diameter=4)\n(@FC|STOCK|id=box|width=8|depth=8|height=4)\n(@FC|ORIGIN|x=?|y=-4|z=2)\n",
         [3], 0, [2]),
        ("(T1 = End Mill {1/0.5.5 mm})\n(T1 = End Mill {1.2.3 mm})\n(T2 = End Mill {4 mm})\n", [2], 0, [2]),
        ("(stockMin:0mm,?,-4mm)\n(stockMax:8mm,8mm,0mm)\n(STOCK/BLOCK,8,8,4,0,0,4)\nT2\n(TOOL/MILL,4,0,0,0)\nT2\n",
         [1, 3], 0, [2]),
    ],
)  # fmt: skip
def test_a_broken_comment_is_refused_alone(text, bad, stocks, tools):
    found = stated("G21\n" + text)
    assert [each.comment.line - 1 for each in found.doubts] == bad
    assert (len(found.stocks), [each.number for each in found.tools]) == (stocks, tools)


# Comments in the form of public posts of other CAM systems: none of them states a tool or a stock for certain.
OTHERS = {
    "CamBam": "( Made using CamBam - http://www.cambam.co.uk )\n( T2 : 2.0 )\nG21 G90 G64 G40\n( T2 : 2.0 )\nT2 M6\n( Contour2 )\n",
    "PyCAM": ";PYCAM_TOOLPATH_SETTINGS: START\n;[Bounds]\n;maxz = 0.0\n;minz = 0.0\n;PYCAM_TOOLPATH_SETTINGS: END\nT4 M6\n",
    "FreeCAD": "(Exported by FreeCAD)\n(Begin operation: TC: 6mm Endmill)\n(TC: 6mm Endmill)\n(Compensated Tool Path. Diameter: 6.0)\nM6 T1\n",
    "Kiri:Moto": "; --- process ---\n; toolFluteDiam=6\n; tool#=1 flute=6 len=20 unit=metric\nG21 ; set units to MM (required)\nM6 T1 ; change tool to 'end 1/4'\n",
    "Estlcam": "(Project part)\n(No. 1: Hole: 3mm)\n(Milling cutter 3mm)\nT1 M6\n",
    "ArtCAM": "(Tool 1 = End Mill 3mm)\n(Tool description: End Mill 3mm)\nT1 M6\n",
    "SolidCAM": "(T1 D10.0 END MILL)\n(TOOL -1- MILL DIA 10.0 R0. MM)\nT1 M6\n",
    "NX": "(TOOL NAME : MILL, DIAMETER : 10.000)\nT01 M06\n",
    "bCNC": "(Block-name: Header)\n(Block-X: 0)\n(Block-name: pocket)\nT1 M6\n",
    "Mastercam": "(DATE=DD-MM-YY - 30-06-05 TIME=HH:MM - 19:37)\n( T1 | 1/2 FLAT ENDMILL | H1 )\nT1 M6\n",
    "FlatCAM": "(G-CODE GENERATED BY FLATCAM)\n(TOOL DIAMETER: 0.8 mm)\n(Units: MM)\nG21\n",
    "ShopBot": "(T1 1/4 inch straight bit)\n(Board size: 2.00 x 1.00 inches)\nT1 M6\n",
}  # fmt: skip


@pytest.mark.parametrize("post", OTHERS)
def test_other_posts_are_left_in_peace(post):
    found = stated(OTHERS[post])
    assert not (found.tools or found.stocks or found.materials or found.doubts)


def test_a_material_of_mastercam():
    (found,) = stated("(MATERIAL - ALUMINUM MM - 2024)\n").materials
    assert found.name == "ALUMINUM MM - 2024"


@pytest.mark.parametrize(
    ("comment", "size"),
    [
        ("Units: 'in' and 'in/min'", 25.4),
        ("machine units: mm/min", 1.0),
        ("MACHINE UNITS: IN/MIN", 25.4),
        ("Units: inch", 25.4),
        ("Units == Millimeters.", 1.0),
        ("ALL DIMENSIONS ARE IN INCHES", 25.4),
        ("units = metric", 1.0),
        ("units: in this file", None),
        ("units per minute", None),
        ("2 units in stock", None),
    ],
)
def test_units_in_words(comment, size):
    assert [each.size_mm for each in stated(f"({comment})\n").units] == ([] if size is None else [size])
