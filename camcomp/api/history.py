"""The history of a machine: diagnoses that are kept, and what drifts in them."""

from datetime import date
from pathlib import Path

from camcomp.diagnosis.history.chronicle import Chronicle, ParameterCourse, chronicle_of
from camcomp.diagnosis.history.folder import keep, kept_in
from camcomp.ground.errors import FileError
from camcomp.ground.files import read_bytes, write_all

__all__ = ["Chronicle", "ParameterCourse", "history", "keep_diagnosis"]


def keep_diagnosis(folder: str, result: str, day: date) -> str:
    """Keeps the result file of a diagnosis whose runs were measured on `day`; the path of what was written.

    Raises ConfigError CC454, CC455, FileError.
    """
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError("CC501", f"cannot make the folder {folder}: {error.strerror}") from error
    path, data = keep(folder, read_bytes(result), name=result, day=day)
    write_all({path: data}, inputs=(result,))
    return path


def history(folder: str, tolerance_um: float = 10.0) -> Chronicle:
    """What the kept diagnoses of a machine say together. tolerance_um: how far the tip may drift before it is measured again.

    Raises ConfigError CC454 for a file that is no kept diagnosis, FileError.
    """
    if not Path(folder).is_dir():
        text = (
            "is a file, and the diagnoses of a machine are kept in a folder"
            if Path(folder).exists()
            else "is not there"
        )
        raise FileError("CC500", f"{folder} {text}", hint="`camcomp history DIR --add RESULT.json` makes the folder")
    return chronicle_of(kept_in(folder), tolerance_um)
