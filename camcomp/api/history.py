"""History of a machine: stored diagnoses, and the drift of parameters over them."""

from datetime import date
from pathlib import Path

from camcomp.diagnosis.history.chronicle import Chronicle, ParameterCourse, chronicle_of
from camcomp.diagnosis.history.folder import keep, kept_in
from camcomp.ground.errors import FileError
from camcomp.ground.files import read_bytes, write_all

__all__ = ["Chronicle", "ParameterCourse", "history", "keep_diagnosis"]


def keep_diagnosis(folder: str, result: str, day: date) -> str:
    """Store the result file of a diagnosis whose runs were measured on `day`, and return the path of the copy.

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
    """Course of all parameters over the stored diagnoses of a machine.

    tolerance_um: drift of the tip that makes a new measurement due, µm. Raises ConfigError CC454 for a file that is no stored
    diagnosis, FileError.
    """
    if not Path(folder).is_dir():
        text = (
            "is a file, and the diagnoses of a machine are kept in a folder"
            if Path(folder).exists()
            else "is not there"
        )
        raise FileError("CC500", f"{folder} {text}", hint="`camcomp history DIR --add RESULT.json` makes the folder")
    return chronicle_of(kept_in(folder), tolerance_um)
