"""Friction winds the drive up, whichever way turns it round: the carriage's behind its spring, or the encoder's before it.

Logs of a machine with nothing wrong, to which the test adds what Maxwell's blocks, drawn by the encoder, do to the tip.
"""

import numpy as np
import pytest

from tests.validation import runner
from tests.validation.every_machine import shipped

FORCE_N, SPRING = 600.0, 2.0e4  # 30 um each way, spring of the shipped machine in N/mm
BLOCKS_MM = (0.0008, 0.0015, 0.003, 0.006)  # ways after which each of four equal blocks slides


def pulled(encoder):
    """Friction (n,) N of blocks that are drawn along encoder (n,) mm, each sliding beyond its way."""
    out = np.zeros(len(encoder))
    for reach in BLOCKS_MM:
        bent = 0.0
        for i, step in enumerate(np.diff(encoder, prepend=encoder[0])):
            bent = float(np.clip(bent + step, -reach, reach))
            out[i] += FORCE_N / len(BLOCKS_MM) * bent / reach
    return out


@pytest.mark.parametrize("logged", ["forces", pytest.param("no forces", marks=pytest.mark.campaign)])
def test_friction_that_the_encoder_s_way_turns_round_is_friction(logged, tmp_path):
    experiment = shipped.experiment(tmp_path, "cartesian", None)
    for log in sorted(tmp_path.glob("*.csv")):
        header, table = log.read_text().partition("\n")[0].split(","), np.loadtxt(log, delimiter=",", skiprows=1)
        force = pulled(table[:, header.index("act_y_mm")])
        table[:, header.index("y_mm")] -= force / SPRING
        table[:, header.index("act_y_N")] += force
        keep = [
            i
            for i, name in enumerate(header)
            if logged == "forces" or not name.startswith("act_") or name.endswith("_mm")
        ]
        names = ",".join(header[i] for i in keep)
        np.savetxt(log, table[:, keep], fmt="%.7f", delimiter=",", header=names, comments="")
    result = runner.ask(experiment)
    assert (result["verdict"], [(c["effect"], c["target"]) for c in result["causes"]]) == (
        "identified",
        [("friction", "y")],
    )
    low, high = result["causes"][0]["parameters"]["force_N"]["ci95"]
    assert low <= FORCE_N <= high
    assert result["causes"][0]["parameters"]["carriage_way"]["value"] == 0.0
