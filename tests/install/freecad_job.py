"""Run by freecadcmd: one Job, posted by several posts in mm and inch, as they are and through the add-on of samples/freecad.

What to do and where to write comes from the JSON file that JOB names; what came of it is written beside it.
"""

import json
import os
import traceback

import FreeCAD
import Part
from PathScripts import PathJob, PathPost, PathPreferences, PathProfile, PathStock
from PathScripts.PathPostProcessor import PostProcessor

CORNER, SIZE = FreeCAD.Vector(-2, -2, -1), (44, 34, 12)
STOCKS = {
    "box": lambda job: PathStock.CreateBox(job, FreeCAD.Vector(*SIZE), FreeCAD.Placement(CORNER, FreeCAD.Rotation())),
    "cylinder": lambda job: PathStock.CreateCylinder(job, 30, 12, FreeCAD.Placement(FreeCAD.Vector(20, 15, -1), FreeCAD.Rotation())),
}  # fmt: skip


def posted_job():
    """A plate of 40 x 30 x 10 mm, milled round in two steps."""
    document = FreeCAD.newDocument("plate")
    plate = document.addObject("Part::Feature", "Plate")
    plate.Shape = Part.makeBox(40, 30, 10)
    document.recompute()
    job = PathJob.Create("Job", [plate], None)
    controller = job.Tools.Group[0]
    controller.HorizFeed, controller.VertFeed, controller.SpindleSpeed = "600 mm/min", "200 mm/min", 8000
    controller.Tool.Flutes = 2
    profile = PathProfile.Create("Profile")
    for name, depth in (("StartDepth", 10.0), ("FinalDepth", 7.0), ("StepDown", 2.0)):
        profile.setExpression(name, None)
        setattr(profile, name, depth)
    document.recompute()
    return job


def change_stock(job, kind):
    """Another stock for the Job; "wedge": a shape that is neither box nor cylinder."""
    if kind in STOCKS:
        job.Stock = STOCKS[kind](job)
    else:
        part = FreeCAD.ActiveDocument.addObject("Part::Feature", "Wedge")
        low, top = CORNER, CORNER + FreeCAD.Vector(*SIZE)
        base = Part.makePolygon([(low.x, low.y, low.z), (top.x, low.y, low.z), (top.x, top.y, low.z),
                                 (low.x + 4, top.y, low.z), (low.x, low.y, low.z)])  # fmt: skip
        part.Shape = Part.Face(base).extrude(FreeCAD.Vector(0, 0, SIZE[2]))
        job.Stock = part
    FreeCAD.ActiveDocument.recompute()


def main():
    """Posts the job of the file."""
    with open(os.environ["JOB"], encoding="utf-8") as file:
        task = json.load(file)
    job = posted_job()
    with open(f"{task['folder']}/home/.local/share/FreeCAD/Mod/camcomp/InitGui.py", encoding="utf-8") as file:
        exec(file.read())  # noqa: S102 as FreeCAD does when its window opens
    said = {"listed": "camcomp" in PathPreferences.allAvailablePostProcessors()}
    objects = PathPost.CommandPathPost().buildPostList(job)[0]
    for post in task["posts"]:
        for unit in ("mm", "inch"):
            words = "--no-show-editor" + " --inches" * (unit == "inch")
            PostProcessor.load(post).export(objects, "{}/{}-{}.nc".format(task["folder"], post, unit), words)
    words = "--config {} --camcomp {} --no-header".format(task["config"], task["camcomp"])
    for stock, post, more in task["through"]:
        change_stock(job, stock)
        name = "{}/camcomp-{}-{}.nc".format(task["folder"], stock, post)
        try:
            PostProcessor.load("camcomp").export(objects, name, f"{words} --post {post} {more}")
            said[post] = "written"
        except Exception as error:  # noqa: BLE001
            said[post] = str(error)
    with open(os.environ["JOB"] + ".out", "w", encoding="utf-8") as file:
        json.dump(said, file)


if "JOB" in os.environ:
    try:
        main()
    except BaseException:  # noqa: BLE001
        traceback.print_exc()
