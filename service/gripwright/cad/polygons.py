"""OBJ, OFF and PLY: files of polygons. Each polygon becomes a fan of triangles at its place in the file's order.

Mesh libraries triangulate such files out of order, which loses what the numbers of the faces mean.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from gripwright.cad.numerals import count, index, real
from gripwright.domain.errors import InvalidGeometry
from gripwright.domain.shape import FloatArray, IntArray

Polygons = tuple[FloatArray, IntArray]
"""Vertices (n, 3) in the file's unit and triangles (m, 3)."""


def fans(polygons: Sequence[Sequence[int]]) -> IntArray:
    """Triangles (m, 3) of polygons in their order; one of fewer than three corners has none."""
    triangles = [(polygon[0], b, c) for polygon in polygons if len(polygon) > 2 for b, c in pairwise(polygon[1:])]
    return np.array(triangles, dtype=np.int64).reshape(-1, 3)


def read_obj(data: bytes) -> Polygons:
    """A Wavefront OBJ file; groups, materials, texture and normals do not matter here."""
    vertices: list[tuple[float, float, float]] = []
    polygons: list[list[int]] = []
    for number, words in _obj_lines(data):
        try:
            if words[0] == "v":
                x, y, z = words[1:4]
                vertices.append((real(x), real(y), real(z)))
            elif words[0] == "f":
                if len(words) < 4:
                    raise ValueError(f"a face of {len(words) - 1} corners")
                polygons.append([_obj_index(word, len(vertices)) for word in words[1:]])
        except ValueError as error:
            raise InvalidGeometry(f"cannot be read: line {number} is no OBJ: {error}") from None
    return np.array(vertices, dtype=np.float64).reshape(-1, 3), fans(polygons)


def _obj_lines(data: bytes) -> Iterator[tuple[int, list[str]]]:
    joined = data.decode("utf-8", errors="replace").replace("\\\r\n", " ").replace("\\\n", " ")
    for number, line in enumerate(joined.splitlines(), start=1):
        words = line.split()
        if words:
            yield number, words


def _obj_index(word: str, vertices: int) -> int:
    """The vertex of a face's corner `v/vt/vn`: counted from 1, or from the last one back."""
    number = index(word.partition("/")[0])
    if number == 0:
        raise ValueError("a corner is vertex 0; the first is 1")
    return number - 1 if number > 0 else vertices + number


def read_off(data: bytes) -> Polygons:
    """An OFF file, with or without colours and normals after the positions."""
    text = data.decode("utf-8", errors="replace")
    lines = [words for line in text.splitlines() if (words := line.partition("#")[0].split())]
    if not lines or not lines[0][0].upper().endswith("OFF"):
        raise InvalidGeometry("cannot be read: it does not begin with OFF")
    first = lines[0][1:]  # the counts may stand on the first line
    lines = [first, *lines[1:]] if first else lines[1:]
    try:
        vertex_count, face_count = count(lines[0][0], "vertices"), count(lines[0][1], "faces")
        vertex_lines, face_lines = lines[1 : 1 + vertex_count], lines[1 + vertex_count : 1 + vertex_count + face_count]
        vertices = np.array([_off_vertex(words) for words in vertex_lines], dtype=np.float64).reshape(-1, 3)
        polygons = [_off_polygon(words) for words in face_lines]
    except IndexError:
        raise InvalidGeometry("ends early: it does not say how many vertices and faces it has") from None
    except ValueError as error:
        raise InvalidGeometry(f"cannot be read as OFF: {error}") from None
    if len(vertices) != vertex_count or len(polygons) != face_count:
        found = f"{len(vertices)} vertices and {len(polygons)} faces"
        raise InvalidGeometry(f"ends early: it declares {vertex_count} vertices and {face_count} faces, and holds {found}")
    return vertices, fans(polygons)


def _off_vertex(words: list[str]) -> list[float]:
    if len(words) < 3:
        raise ValueError(f"a vertex of {len(words)} coordinates")
    return [real(word) for word in words[:3]]


def _off_polygon(words: list[str]) -> list[int]:
    corners = count(words[0], "corners")
    if corners > len(words) - 1:
        raise ValueError(f"a face declares {corners} corners, and has {len(words) - 1}")
    return [index(word) for word in words[1 : 1 + corners]]
