"""Packages of a user's, installed as pip leaves them: modules beside a dist-info folder with entry points."""


def install(folder, shelf, name, source, *, module=None, value=None):
    """Puts a package with one plug-in into `folder` (to be on sys.path); its module, unless told otherwise, is its name."""
    module = module or name
    if source is not None:
        (folder / f"{module}.py").write_text(source, encoding="utf-8")
    info = folder / f"our_{name}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: our-{name}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[camcomp.{shelf}]\n{name} = {value or module}\n")
