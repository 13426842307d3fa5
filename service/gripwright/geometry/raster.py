"""Which face of a mesh is seen first at each sample of an orthographic picture."""

import numba
import numpy as np

from gripwright.domain.shape import FloatArray, IntArray

NOTHING = -1


def first_seen(corners: FloatArray, rows: int, columns: int) -> tuple[IntArray, FloatArray]:
    """Face of each sample (rows, columns), `NOTHING` where there is none, and its depth (inf there).

    `corners` (m, 3, 3): column, row and depth of each face's corners, in samples; the unit of depth is the caller's. The middle
    of a sample is at whole numbers. A sample on an edge belongs to one of the two faces beside it; of equal depths the first
    face is seen.
    """
    face = np.full((rows, columns), NOTHING, dtype=np.int64)
    depth = np.full((rows, columns), np.inf)
    _fill(np.ascontiguousarray(corners, dtype=np.float64), face, depth)
    return face, depth


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _fill(corners: FloatArray, face: IntArray, depth: FloatArray) -> None:
    rows, columns = face.shape
    for k in range(len(corners)):
        x0, y0, z0 = corners[k, 0, 0], corners[k, 0, 1], corners[k, 0, 2]
        x1, y1, z1 = corners[k, 1, 0], corners[k, 1, 1], corners[k, 1, 2]
        x2, y2, z2 = corners[k, 2, 0], corners[k, 2, 1], corners[k, 2, 2]
        twice = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if twice == 0.0:
            continue  # seen edge-on
        first, last = max(int(np.ceil(min(y0, y1, y2))), 0), min(int(np.ceil(max(y0, y1, y2))), rows)
        if first >= last:
            continue
        along_x = ((z1 - z0) * (y2 - y0) - (z2 - z0) * (y1 - y0)) / twice
        along_y = ((z2 - z0) * (x1 - x0) - (z1 - z0) * (x2 - x0)) / twice
        least, most = min(z0, z1, z2), max(z0, z1, z2)
        for row in range(first, last):
            a, b, c = _crossing(x0, y0, x1, y1, row), _crossing(x1, y1, x2, y2, row), _crossing(x2, y2, x0, y0, row)
            begin, end = max(int(np.ceil(min(a[0], b[0], c[0]))), 0), min(int(np.ceil(max(a[1], b[1], c[1]))), columns)
            start = z0 + along_y * (row - y0) - along_x * x0
            for column in range(begin, end):
                z = min(max(start + along_x * column, least), most)  # of faces seen almost edge-on
                if z < depth[row, column]:
                    depth[row, column] = z
                    face[row, column] = k


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _crossing(x0: float, y0: float, x1: float, y1: float, row: int) -> tuple[float, float]:
    """Where an edge crosses a row, twice; the same figures whichever end comes first. (inf, -inf) where it does not."""
    if y0 > y1:
        x0, y0, x1, y1 = x1, y1, x0, y0
    if not y0 <= row < y1:
        return np.inf, -np.inf
    x = x0 + (row - y0) / (y1 - y0) * (x1 - x0)
    return x, x
