"""Import of recordings of other systems as logs and an experiment file."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from camcomp.diagnosis.recordings.experiment_file import experiment_yaml, run_names
from camcomp.diagnosis.recordings.formats import read_sampled
from camcomp.diagnosis.recordings.naming import match_columns
from camcomp.diagnosis.recordings.run_log import Recording, Wishes, columns_of_axis, log_of
from camcomp.diagnosis.recordings.sampled import SampledColumns, refuse_names
from camcomp.ground.errors import FileError
from camcomp.ground.files import display_name, read_bytes, write_all
from camcomp.ground.progress import steps
from camcomp.model.config.load import load_config


def import_recordings(
    files: Sequence[str], configs: Sequence[str], output_dir: str | Path, *, actuator: str | None = None,
    columns: Sequence[str] = (), names: Sequence[str] = (), period_s: float | None = None, degrees: bool | None = None,
    by: str | None = None, programs: Sequence[str] = (), cutting: bool = False, one_clamping: bool = False,
    holdout: Sequence[str] = (), rows: int | None = None,
) -> tuple[list[Recording], Path]:  # fmt: skip
    """Write a log for every file (or FILE+FILE) and an experiment file; return the recordings and the experiment file.

    The options are those of `camcomp import`. Raises ConfigError for an unusable recording, FileError.
    """
    actuators = load_config(configs).robot.actuators
    groups = [_files_of(each) for each in files]
    called = run_names([group[0] for group in groups])
    run_programs = _programs(programs, called)
    told = match_columns(columns, list(actuators), [each.rotary for each in actuators.values()])
    recordings = list[Recording]()
    for run, group in steps(zip(called, groups, strict=True), len(groups)):
        parts = _parts(group, [each.split() for each in names], period_s)
        wishes = Wishes(
            columns=columns_of_axis(parts, actuators, actuator) | told, rows=rows, degrees=degrees, period_s=period_s,
            join=by, program=run in run_programs,
        )  # fmt: skip
        recordings.append(log_of(run, parts, actuators, wishes))
    out = Path(output_dir)
    outputs: dict[Path, bytes] = {out / f"{each.name}.csv": each.log for each in recordings}
    outputs[out / "experiment.yaml"] = experiment_yaml(
        recordings, configs, out, holdout, run_programs, cutting=cutting, one_clamping=one_clamping
    )
    _write(out, outputs, [*(file for group in groups for file in group), *configs, *run_programs.values()])
    return recordings, out / "experiment.yaml"


def _files_of(word: str) -> list[str]:
    """Files of one run: a file, or several joined by +."""
    return [word] if os.path.lexists(word) else word.split("+")


def _parts(group: Sequence[str], names: Sequence[Sequence[str]], period_s: float | None) -> list[SampledColumns]:
    """Contents of the files of one run; names: of columns of tables without header, by file, the last for all others."""
    parts = list[SampledColumns]()
    for k, file in enumerate(group):
        own = names[min(k, len(names) - 1)] if names else ()
        parts += read_sampled(read_bytes(file), display_name(file), own, period_s)
    refuse_names(parts, names)
    return parts


def _programs(words: Sequence[str], runs: Sequence[str]) -> dict[str, str]:
    """Program by run. Raises FileError CC500 for a missing file."""
    out: dict[str, str] = {}
    for word in words:
        run, mark, file = word.partition("=")
        named = bool(mark) and not os.path.lexists(word)
        file = file if named else word
        read_bytes(file)
        out |= {run: file} if named else dict.fromkeys(runs, file)
    return out


def _write(out: Path, outputs: dict[Path, bytes], inputs: Sequence[str]) -> None:
    for path in outputs:
        if os.path.lexists(path):
            raise FileError("CC501", f"{path} is there already", hint="choose another folder")
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError("CC501", f"cannot make {out}: {error.strerror}") from error
    write_all(outputs, inputs=inputs)
