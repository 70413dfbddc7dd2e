"""MATLAB files by scipy's writer; whatever bytes are overwritten, the answer is numbers or a refusal."""

import io
import random

import numpy as np
import pytest
from scipy.io import savemat

from camcomp.diagnosis.recordings.mat_file import read_mat, read_matlab
from camcomp.ground.errors import CamcompError


def saved(variables, **options):
    file = io.BytesIO()
    savemat(file, variables, **options)
    return file.getvalue()


@pytest.mark.parametrize("compressed", [False, True])
def test_numbers_of_all_types_are_those_that_were_saved(compressed):
    wanted = {
        "t": np.linspace(0.0, 1.0, 7),
        "long_name": np.arange(6.0).reshape(2, 3),
        "i1": np.array([-1, 2], np.int8),
        "u2": np.array([60000], np.uint16),
        "i8": np.array([-(2**40)]),
        "f4": np.array([0.5, 1.5], np.float32),
        "none": np.zeros((0, 1)),
    }
    others = {"text": "words", "cell": np.array([{"a": 1.0}, "b"], object), "struct": {"a": 1.0}}
    found = read_mat(saved({**wanted, **others}, do_compression=compressed))
    assert set(found) == set(wanted)
    for name, values in wanted.items():
        assert np.array_equal(found[name], values.ravel(order="F")), name


@pytest.mark.parametrize("data", [b"", b"words", b"MATLAB 7.3 MAT-file" + bytes(200), bytes(300)])
def test_what_is_no_such_file_is_refused(data):
    with pytest.raises(CamcompError) as refused:
        read_matlab(data, "f.mat")
    assert refused.value.rule == "CC452"


@pytest.mark.parametrize("compressed", [False, True])
def test_overwritten_bytes_are_a_refusal_or_numbers(compressed):
    t = np.arange(50) * 1e-3
    whole = saved({"t": t, "qg": t, "qm": t, "vir": t, "gtau": 2.0}, do_compression=compressed)
    dice = random.Random(1)
    refused = 0
    for _ in range(300):
        data = bytearray(whole)
        for _ in range(dice.randint(1, 6)):
            data[dice.randrange(len(data))] = dice.randrange(256)
        try:
            (part,) = read_matlab(bytes(data), "f.mat")
            assert len({len(part.read(k)) for k in range(len(part.names))}) == 1
        except CamcompError as error:
            assert error.rule == "CC452"
            refused += 1
    assert 30 < refused < 300
