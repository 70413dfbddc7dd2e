"""What begins at several actuators at once is one event, and none of theirs."""

from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.search.beside import _shared_events

ROW_S = 0.05


@pytest.mark.parametrize(("later", "one_event"), [(0.0, True), (1.0 * ROW_S, True), (3.0 * ROW_S, False)])
def test_two_that_begin_within_two_rows_of_one_another(later, one_event):
    began, lasting = SimpleNamespace(name="from_s", placed=True), SimpleNamespace(name="pitch_mm", placed=False)
    candidates = [SimpleNamespace(shapes=shapes) for shapes in ((began,), (began,), (lasting,), ())]
    path = SimpleNamespace(time=np.arange(0.0, 10.0, ROW_S))
    problem = SimpleNamespace(
        columns=SimpleNamespace(candidates=candidates), bench=SimpleNamespace(runs=[SimpleNamespace(run_path=path)]),
        passing=lambda i: any(p.placed for p in candidates[i].shapes),
    )  # fmt: skip
    f = SimpleNamespace(extra={0: {"from_s": 4.0}, 1: {"from_s": 4.0 + later}, 2: {"pitch_mm": 4.0}})
    assert _shared_events(problem, f, (0, 1, 2, 3)) == ({0, 1} if one_event else set())
    assert _shared_events(problem, f, (0, 2, 3)) == set()
