"""A program that is run twice in one file cuts air the second time: its bytes stay, and no force acts."""

import pytest

from camcomp.compensation.program.compensate import compensate
from camcomp.model.config.load import load_config
from camcomp.model.control import program_of
from camcomp.model.job import Job
from tests.commandline import ROOT

SAMPLES = sorted((ROOT / "samples").rglob("*.nc"))
STOCK = "workpiece: {stock: {type: program, margin_mm: 2}}\ntool: {diameter_mm: 10, teeth: 2}\n"
ENDS = ("M5", "M30", "M2", "%")


def twice(text):
    """The program with its moves once more in front of its end, and the lines of the second run."""
    lines = text.splitlines()
    end = next(k for k, each in enumerate(lines) if each.split()[-1:] and each.split()[-1] in ENDS[:3])
    begin = next(k for k, each in enumerate(lines) if "G0" in each)
    again = lines[begin:end]
    return "\n".join([*lines[:end], *again, *lines[end:]]) + "\n", again


@pytest.mark.parametrize("path", SAMPLES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_the_second_run_of_a_sample_is_left_as_it_is(path, tmp_path):
    (tmp_path / "stock.yaml").write_text(STOCK)
    own = path.parent / "stock.yaml"
    stock = own if own.exists() else tmp_path / "stock.yaml"
    job = Job(load_config([ROOT / "config/orthoglide.yaml", stock]))
    text, again = twice(path.read_text(encoding="utf-8"))
    program = program_of(text.encode(), path.name, job.config)
    result = compensate(program, job, method="newton", tolerance_um=1.0, version="1")
    written = result.written.data.decode().splitlines()
    end = next(k for k in range(len(written) - 1, 0, -1) if written[k] == again[-1])
    assert written[end + 1 - len(again) : end + 1] == again
    first = next(k for k in range(len(text.splitlines())) if text.splitlines()[k : k + len(again)] == again)
    late = result.lines > first + len(again)
    assert late.any() and not result.rows.force[late].any()
    assert result.rows.force[~late].any(), "the first run cuts"
