"""Run by FreeCAD with a window: pictures of the Job's output tab, and of what the add-on shows when the Job is posted.

WINDOW names a JSON file: folder of the pictures, machine file, camcomp, and the folder of this file.
"""

import json
import os
import sys
import traceback

import FreeCAD
import FreeCADGui
from PySide2 import QtCore, QtWidgets

SIZE = (1000, 640)
DIALOG = (460, 310)
WAIT_MS = 1500  # for the window to be drawn
MM_PER_MINUTE = 6  # FreeCAD's number of this system of units; with another one the workbench asks at its start


def picture(widget, task, name):
    """Write a picture of a widget; None: of the screen, with what OpenGL draws."""
    for _ in range(3):
        QtWidgets.QApplication.processEvents()
    grabbed = widget.grab() if widget else QtWidgets.QApplication.primaryScreen().grabWindow(0)
    grabbed.save(os.path.join(task["folder"], f"freecad-{name}.png"))


def dialog_of(job, task):
    """The Job's dialog with the add-on chosen on its tab Output."""
    from PathScripts import PathJobGui

    job.ViewObject.Proxy = PathJobGui.ViewProvider(job.ViewObject)
    panel = PathJobGui.TaskPanel(job.ViewObject, lambda *_: True)
    form = panel.form
    panel.setupUi(activate=None)
    form.setCurrentIndex(1)
    form.resize(*DIALOG)
    form.show()
    picture(form, task, "output")
    form.close()


def posted(job, task):
    """The box with the figures, over the window with the Job."""
    from PathScripts.PathPost import CommandPathPost
    from PathScripts.PathPostProcessor import PostProcessor

    def shown():
        box = QtWidgets.QApplication.activeModalWidget()
        if box is None:
            QtCore.QTimer.singleShot(WAIT_MS, shown)
            return
        picture(box, task, "figures")
        box.accept()

    QtCore.QTimer.singleShot(WAIT_MS, shown)
    objects = CommandPathPost().buildPostList(job)[0]
    PostProcessor.load("camcomp").export(objects, os.path.join(task["folder"], "part.nc"), job.PostProcessorArgs)


def main():
    """Make the first picture, and start the others."""
    try:
        with open(os.environ["WINDOW"], encoding="utf-8") as file:
            task = json.load(file)
        sys.path.insert(0, task["tests"])
        from freecad_job import posted_job

        FreeCAD.Units.setSchema(MM_PER_MINUTE)
        FreeCAD.ParamGet("User parameter:BaseApp/Preferences/Mod/Path").SetBool("WarningSuppressVelocity", True)
        window = FreeCADGui.getMainWindow()
        window.move(0, 0)
        window.resize(*SIZE)
        FreeCADGui.activateWorkbench("PathWorkbench")
        job = posted_job()
        job.PostProcessor = "camcomp"
        job.PostProcessorArgs = "--config machine.yaml --post linuxcnc"
        job.PostProcessorOutputFile = "part.nc"
        dialog_of(job, task)
        job.PostProcessorArgs = "--config {config} --camcomp {camcomp} --no-header".format(**task)
        view = FreeCADGui.ActiveDocument.ActiveView
        view.viewIsometric()
        view.fitAll()
        job.Operations.Group[0].ViewObject.Visibility = True
        QtCore.QTimer.singleShot(WAIT_MS, lambda: finished(job, task))
    except BaseException:  # noqa: BLE001
        traceback.print_exc()
        os._exit(1)


def finished(job, task):
    """The last pictures, once the view is drawn, and the end of FreeCAD."""
    try:
        picture(None, task, "job")
        posted(job, task)
    except BaseException:  # noqa: BLE001
        traceback.print_exc()
    os._exit(0)


QtCore.QTimer.singleShot(2 * WAIT_MS, main)
