"""FreeCAD post-processor: another post writes the program, camcomp compensates it with stock and tools of the Job.

Arguments of the Job's output: `--config machine.yaml` (needed; may be repeated), `--post linuxcnc` (the post that writes the
program), `--camcomp COMMAND`, `--report` (a page beside the program). All others go to that post, e.g. `--inches`.
Tried in FreeCAD 0.20. The names of modules in FreeCAD 1.x are those of its documentation; they have not been tried.
"""

import argparse
import importlib
import json
import os
import shlex
import subprocess
import tempfile

import FreeCAD

TOOLTIP = "Compensates the program of another post for the errors of the machine (camcomp)"
TOOLTIP_ARGS = __doc__
UNITS = "G21"
FORMS = {"endmill": "flat", "ballend": "ball", "bullnose": "bull", "drill": "drill"}
SAME = 1e-6  # relative, of volumes and lengths
MESH_MM = 0.05  # chord error of a stock that is neither box nor cylinder

_parser = argparse.ArgumentParser(prog="camcomp", add_help=False)
_parser.add_argument("--config", action="append", default=[])
_parser.add_argument("--post", default="linuxcnc")
_parser.add_argument("--camcomp", default="camcomp")
_parser.add_argument("--report", action="store_true")


class PostError(Exception):
    """The program was not written, and why."""


def export(objectslist, filename, argstring):
    """Write the compensated program; what FreeCAD calls. Returns its text."""
    options, others = _parser.parse_known_args(shlex.split(argstring))
    if not options.config:
        raise PostError("camcomp: write --config machine.yaml into the arguments of the Job's output")
    job = job_of(objectslist)
    with tempfile.TemporaryDirectory() as folder:
        posted, stated = os.path.join(folder, "posted.nc"), os.path.join(folder, "job.yaml")
        if "--no-show-editor" not in others:
            others.append("--no-show-editor")
        post(options.post).export(objectslist, posted, " ".join(shlex.quote(each) for each in others))
        if not os.path.exists(posted):
            raise PostError(f"camcomp: the post '{options.post}' wrote no program")
        with open(stated, "w", encoding="utf-8") as file:
            unit = {"control": {"program_unit": "inch"}} if "--inches" in others else {}  # some posts write no G20
            json.dump({**sections_of(job, folder), **unit}, file, indent=1)  # JSON is YAML
        text, figures = compensated(options, posted, stated, filename)
    show(figures)
    return text


def compensated(options, posted, stated, filename):
    """The compensated program, written to filename ("-": not at all), and the lines that camcomp says."""
    out = os.path.join(os.path.dirname(posted), "compensated.nc")
    command = [*shlex.split(options.camcomp), "compensate", posted, "-o", out]
    for each in [*options.config, stated]:
        command += ["--config", each]
    if options.report and filename != "-":
        command += ["--report", os.path.splitext(filename)[0] + ".html"]
    # FreeCAD's own Python and libraries are not those of camcomp.
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONHOME", "LD_LIBRARY_PATH")}
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    except OSError as error:
        raise PostError(f"camcomp: {error}; write --camcomp PATH into the arguments of the Job's output") from error
    if done.returncode:
        raise PostError(f"camcomp ended with exit code {done.returncode}, and no program was written:\n{done.stderr}")
    with open(out, "rb") as file:
        data = file.read()
    if filename != "-":
        with open(filename, "wb") as file:
            file.write(data)
    return data.decode("utf-8", "replace"), done.stderr.strip()


def post(name):
    """The module of a post-processor of FreeCAD or of the user. Raises PostError."""
    for module in ("PathScripts.post.%s_post", "Path.Post.scripts.%s_post", "%s_post"):
        try:
            return importlib.reload(importlib.import_module(module % name))
        except ModuleNotFoundError:
            continue
    raise PostError(f"camcomp: there is no post-processor '{name}'")


def job_of(objectslist):
    """The Job that the operations of a list belong to. Raises PostError."""
    wanted = {getattr(each, "Name", None) for each in objectslist} - {None}
    for each in FreeCAD.ActiveDocument.Objects:
        if hasattr(each, "Operations") and hasattr(each, "Stock") and hasattr(each, "Tools"):
            group = [*each.Operations.Group, *tools_of(each)]
            if wanted & {member.Name for member in group} or each.Name in wanted:
                return each
    raise PostError("camcomp: the operations belong to no Job")


def tools_of(job):
    """Tool controllers of a Job."""
    return getattr(job.Tools, "Group", job.Tools)


def sections_of(job, folder):
    """Stock and tools as sections of a machine file; a file of the stock's shape is written to a folder."""
    fixtures = [str(each) for each in job.Fixtures]
    if fixtures != ["G54"]:
        raise PostError("camcomp: the Job posts in {}; its stock is known in G54 only".format(", ".join(fixtures)))
    tools = {}
    for controller in tools_of(job):
        keys = cutter(controller.Tool)
        if keys:
            tools[controller.ToolNumber] = keys
        else:
            FreeCAD.Console.PrintWarning(f"camcomp: T{controller.ToolNumber} is no mill and no drill: left out\n")
    sections = {"workpiece": {"stock": stock(job.Stock.Shape, folder)}, "tools": tools}
    if len(tools) == 1:  # some posts write no tool change
        sections["tool"] = next(iter(tools.values()))
    return sections


def stock(shape, folder):
    """The stock as `workpiece: stock`: a box along the axes, an upright cylinder, or the shape as STL."""
    box = shape.BoundBox
    low, high = [box.XMin, box.YMin, box.ZMin], [box.XMax, box.YMax, box.ZMax]
    if abs(shape.Volume - box.XLength * box.YLength * box.ZLength) <= SAME * shape.Volume:
        return {"type": "box", "min_mm": low, "max_mm": high}
    round_faces = [each.Surface for each in shape.Faces if type(each.Surface).__name__ == "Cylinder"]
    if len(round_faces) == 1 and len(shape.Faces) == 3:
        surface = round_faces[0]
        solid = 3.141592653589793 * surface.Radius**2 * box.ZLength
        if abs(abs(surface.Axis.z) - 1.0) <= SAME and abs(shape.Volume - solid) <= SAME * solid:
            centre = [surface.Center.x, surface.Center.y]
            return {"type": "cylinder", "centre_mm": centre, "diameter_mm": 2 * surface.Radius,
                    "bottom_mm": low[2], "top_mm": high[2]}  # fmt: skip
    import MeshPart

    path = os.path.join(folder, "stock.stl")
    MeshPart.meshFromShape(Shape=shape, LinearDeflection=MESH_MM, AngularDeflection=0.1).write(path)
    return {"type": "stl", "file": path}


def cutter(bit):
    """A tool bit as keys of `tools:`; empty for one that is neither mill nor drill."""
    form = FORMS.get(str(getattr(bit, "ShapeType", "") or getattr(bit, "ShapeName", "")).lower())
    if form is None:
        return {}
    keys = {"type": form, "diameter_mm": millimetres(bit.Diameter)}
    if form == "bull" and hasattr(bit, "CornerRadius"):
        keys["corner_radius_mm"] = millimetres(bit.CornerRadius)
    elif form == "bull":  # FreeCAD 0.20: the radius of the flat part of the bottom
        keys["corner_radius_mm"] = 0.5 * keys["diameter_mm"] - millimetres(bit.FlatRadius)
    if form == "drill" and hasattr(bit, "TipAngle"):
        keys["point_deg"] = float(getattr(bit.TipAngle, "Value", bit.TipAngle))
    if hasattr(bit, "CuttingEdgeHeight"):
        keys["flute_length_mm"] = millimetres(bit.CuttingEdgeHeight)
    if int(getattr(bit, "Flutes", 0)) > 0:
        keys["teeth"] = int(bit.Flutes)
    return keys


def millimetres(value):
    """A length of FreeCAD, which counts in mm inside."""
    return float(getattr(value, "Value", value))


def show(text):
    """The figures in FreeCAD's report view, and in a box where there is a window."""
    FreeCAD.Console.PrintMessage(f"camcomp: {text}\n")
    if FreeCAD.GuiUp:
        from PySide import QtGui

        QtGui.QMessageBox.information(None, "camcomp", text)
