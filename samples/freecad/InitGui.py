"""Makes FreeCAD list the post-processor of this folder among its own; FreeCAD runs this when its window opens."""


def _listed():
    import os

    try:
        from Path import Preferences as preferences  # FreeCAD 0.21 and later
    except ImportError:
        from PathScripts import PathPreferences as preferences  # FreeCAD 0.20
    import camcomp_post

    folder, paths = os.path.dirname(camcomp_post.__file__), preferences.searchPathsPost
    preferences.searchPathsPost = lambda: [*paths(), folder]


_listed()
