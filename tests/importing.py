"""Runs `camcomp import` in this process and reads its output."""

from types import SimpleNamespace

from camcomp.terminal.cli import run
from tests.commandline import ROOT, table


def imported(capsys, folder, *words, config="ur10"):
    """Exit code, standard error, the logs by run, and the experiment file of an import into `folder`."""
    code = run(["import", *map(str, words), "--config", str(ROOT / f"config/{config}.yaml"), "-o", str(folder)])
    told = capsys.readouterr()
    assert told.out == ""
    logs = {path.stem: table(path) for path in folder.glob("*.csv")} if folder.is_dir() else {}
    file = folder / "experiment.yaml"
    return SimpleNamespace(code=code, told=told.err, logs=logs, yaml=file.read_text() if file.exists() else None)
