"""Text of a diagnosis on the terminal: the same as its JSON, in words."""

import json
import re

import pytest

from tests.commandline import camcomp


def test_the_answer_is_told_on_standard_error_and_nothing_else_on_standard_output(tmp_path):
    out = tmp_path / "o.json"
    done = camcomp("diagnose", "samples/diagnosis/clear/experiment.yaml", "--json", out)
    assert done.returncode == 0 and done.stdout == b""
    told = [line for line in done.stderr.decode().splitlines() if not line.startswith("diagnosing ")]  # progress
    result = json.loads(out.read_text())
    cause = result["causes"][0]
    assert told[0].startswith(f"identified: {cause['effect']} ({cause['target']}) explains the gap")
    assert told[1].startswith(f"  {cause['effect']} ({cause['target']}): ")
    (width,) = re.findall(r"width ([\d.]+) um", told[1])
    assert float(width) == pytest.approx(1e3 * cause["parameters"]["width_mm"]["value"], abs=0.05)
    assert told[2].startswith("    do: adjust the preload")
    assert any(f"{100 * result['shrinkage']['ratio']:.0f} %" in line for line in told if "unseen" in line)


def test_quiet_is_quiet():
    done = camcomp("diagnose", "samples/diagnosis/clear/experiment.yaml", "--json", "-", "--quiet")
    assert done.returncode == 0 and done.stderr == b""
    assert json.loads(done.stdout)["verdict"] == "identified"
