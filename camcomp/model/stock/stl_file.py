"""Triangles of an STL file, binary or text, and whether they bound a body.

Binary: 80 bytes of header, the number of triangles (uint32, little endian), 50 bytes a triangle: normal and three corners
as float32, two bytes of attributes. Text: `facet`, `vertex X Y Z` three times, `endfacet`; names may be in any encoding.

Source: 3D Systems, StereoLithography Interface Specification, 1989.
"""

from __future__ import annotations

import re

import numpy as np

from camcomp.ground.datatypes import Floats

_HEADER_BYTES, _TRIANGLE_BYTES = 84, 50
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])
_VERTEX = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)
_MERGED_DIGITS = 3  # corners are one within a micrometre


def triangles_of(data: bytes) -> Floats:
    """Corners (n, 3, 3) of the triangles of an STL file's bytes.

    Raises:
        ValueError: the bytes are no STL file.
    """
    triangles = _triangles_of(data)
    lost = np.flatnonzero(~np.isfinite(triangles).all(axis=(1, 2)))
    if len(lost):
        raise ValueError(f"a corner of triangle {lost[0] + 1} is no number")
    return triangles


def _triangles_of(data: bytes) -> Floats:
    count = int.from_bytes(data[80:_HEADER_BYTES], "little")
    wanted = _HEADER_BYTES + _TRIANGLE_BYTES * count
    if len(data) >= _HEADER_BYTES and len(data) == wanted:
        return np.frombuffer(data, _RECORD, count, _HEADER_BYTES)["corners"].astype(float)
    text = data.lstrip()[:5].lower() == b"solid" and b"\0" not in data
    if text or len(data) < _HEADER_BYTES:
        return _from_text(data)
    raise ValueError(
        f"its header counts {count} triangles, which are {wanted} bytes, and the file has {len(data)}"
        f" ({(len(data) - _HEADER_BYTES) / _TRIANGLE_BYTES:g} triangles)"
    )


def _from_text(data: bytes) -> Floats:
    try:
        corners = np.array(_VERTEX.findall(data)).astype(float)
    except ValueError:
        raise ValueError("a vertex of the text is no three numbers") from None
    facets = len(re.findall(rb"\bendfacet\b", data, re.IGNORECASE))
    if len(corners) != 3 * facets:
        raise ValueError(f"its text has {facets} facets and {len(corners)} corners, not three for each")
    return corners.reshape(-1, 3, 3)


def open_edges(triangles: Floats) -> Floats:
    """First corners (k, 3) of the edges that an odd number of triangles share; none where the triangles bound a body."""
    corners, at = np.unique(np.round(triangles.reshape(-1, 3), _MERGED_DIGITS), axis=0, return_inverse=True)
    faces = at.reshape(-1, 3)
    edges = np.sort(np.concatenate((faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]])), axis=1)
    edges, shared = np.unique(edges[edges[:, 0] != edges[:, 1]], axis=0, return_counts=True)
    return np.asarray(corners[edges[shared % 2 > 0, 0]])
