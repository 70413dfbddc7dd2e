"""STL files whose corners are no numbers are refused with the triangle."""

import struct

import numpy as np
import pytest

from camcomp.model.stock.stl_file import triangles_of

WHOLE = [[0, 0, 0], [10, 0, 0], [0, 10, 0]]


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("binary", [True, False])
def test_a_corner_that_is_no_number_is_refused(bad, binary):
    triangles = [WHOLE, [[0, 0, 0], [10, 0, bad], [0, 10, 5]]]
    if binary:
        data = b"\0" * 80 + struct.pack("<I", 2)
        data += b"".join(struct.pack("<12f2x", 0, 0, 1, *np.ravel(each)) for each in triangles)
    else:
        facets = (
            "outer loop\n" + "".join("vertex {} {} {}\n".format(*c) for c in each) + "endloop" for each in triangles
        )
        data = (
            "solid a\n" + "".join(f"facet normal 0 0 1\n{each}\nendfacet\n" for each in facets) + "endsolid a\n"
        ).encode()
    with pytest.raises(ValueError, match="a corner of triangle 2 is no number"):
        triangles_of(data)
