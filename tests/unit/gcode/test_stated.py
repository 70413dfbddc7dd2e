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
        ("(@FC|TOOL|number=2|type=bullnose|diameter=6|cornerRadius=5)", "does not fit"),
    ],
)
def test_tools_that_cannot_be_are_doubts(text, why):
    found = stated(text)
    assert not found.tools
    assert [why in each.why for each in found.doubts] == [True]


def test_programs_without_marks_state_nothing():
    assert stated("(STOCKTAKING)\n(pocket D 6)\nG1 X1 T1\n") == stated("")
