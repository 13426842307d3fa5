"""STL, binary and ASCII: triangles without units."""

import re

import numpy as np

from gripwright.cad.numerals import real
from gripwright.cad.polygons import Polygons
from gripwright.domain.errors import InvalidGeometry
from gripwright.domain.shape import FloatArray

RECORD = np.dtype([("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
HEADER_BYTES = 84
_VERTEX = re.compile(rb"^\s*vertex\s+(\S+)\s+(\S+)\s+(\S+)", re.MULTILINE | re.IGNORECASE)
_END_OF_SOLID = re.compile(rb"^\s*endsolid\b", re.MULTILINE | re.IGNORECASE)
_END_OF_FACET = re.compile(rb"^\s*endloop\b", re.MULTILINE | re.IGNORECASE)


def read_stl(data: bytes) -> Polygons:
    """Three vertices a triangle, in the file's order; binary where the length fits the number of triangles it declares."""
    count = int.from_bytes(data[HEADER_BYTES - 4 : HEADER_BYTES], "little")
    if len(data) == HEADER_BYTES + count * RECORD.itemsize:
        corners = np.frombuffer(data, RECORD, count, HEADER_BYTES)["corners"]
    elif data[:1024].lstrip()[:5].lower() == b"solid":
        corners = _ascii_corners(data)
    elif len(data) > HEADER_BYTES + count * RECORD.itemsize:  # some exporters append their own data
        corners = np.frombuffer(data, RECORD, count, HEADER_BYTES)["corners"]
    else:
        raise InvalidGeometry(f"ends early: it declares {count} triangles, and holds {len(data)} bytes")
    vertices = corners.reshape(-1, 3).astype(np.float64)
    return vertices, np.arange(len(vertices), dtype=np.int64).reshape(-1, 3)


def _ascii_corners(data: bytes) -> FloatArray:
    """Corners (3m, 3)."""
    found, ends = _VERTEX.findall(data), [end.end() for end in _END_OF_FACET.finditer(data)]
    facets, last = len(ends), max(ends, default=0)
    if len(found) != 3 * facets:
        raise InvalidGeometry(f"cannot be read: {facets} facets with {len(found)} vertices together are no ASCII STL")
    if facets and _END_OF_SOLID.search(data, last) is None:
        raise InvalidGeometry(f"ends early: after {facets} facets there is no endsolid")
    try:
        return np.array([[real(word.decode("latin-1")) for word in words] for words in found], dtype=np.float64).reshape(-1, 3)
    except ValueError as error:
        raise InvalidGeometry(f"cannot be read as ASCII STL: {error}") from None
