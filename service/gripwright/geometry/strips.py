"""How far a planar region reaches within strips of some width, for many directions at once. Lengths in mm."""

import numpy as np
import shapely

from gripwright.domain.shape import FloatArray


def boundary_edges(region: shapely.Geometry) -> FloatArray:
    """The edges of a region's outlines, those of its holes too, (m, 2, 2): start and end of each."""
    parts = [part for part in shapely.get_parts(region) if shapely.area(part) > 0.0]
    rings = [np.asarray(shapely.get_coordinates(ring)) for part in parts for ring in shapely.get_rings(part)]
    edges = [np.stack([ring[:-1], ring[1:]], axis=1) for ring in rings]
    return np.concatenate(edges) if edges else np.zeros((0, 2, 2))


def strip_ranges(edges: FloatArray, along: FloatArray, offsets: FloatArray, width: float) -> FloatArray:
    """Where a region begins and ends along each direction within each strip, (t, k, 2); begin > end where a strip misses it.

    `edges` (m, 2, 2) bound the region, `along` (t, 2) are unit vectors, and strip k of direction t is centred `offsets[t, k]`
    to the left of the origin. Within a strip a region reaches farthest on its boundary.
    """
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    level, aside = edges @ along.T, edges @ across.T  # (m, 2, t)
    rise, run = np.diff(level, axis=1)[:, 0].T, np.diff(aside, axis=1)[:, 0].T  # (t, m)
    start, origin = aside[:, 0].T[:, None], level[:, 0].T[:, None]  # (t, 1, m)
    sides = offsets[:, :, None] + np.array([-width / 2.0, width / 2.0])  # (t, k, 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        enter, leave = ((sides[:, :, side, None] - start) / run[:, None] for side in (0, 1))  # (t, k, m)
    flat = np.broadcast_to(run[:, None] == 0.0, enter.shape)
    between = (sides[:, :, 0, None] <= start) & (start <= sides[:, :, 1, None])
    first = np.where(flat, np.where(between, 0.0, np.inf), np.maximum(np.minimum(enter, leave), 0.0))
    last = np.where(flat, np.where(between, 1.0, -np.inf), np.minimum(np.maximum(enter, leave), 1.0))
    met = first <= last
    ends = [origin + np.where(met, share, 0.0) * rise[:, None] for share in (first, last)]
    begin = np.where(met, np.minimum(*ends), np.inf).min(axis=2, initial=np.inf)
    end = np.where(met, np.maximum(*ends), -np.inf).max(axis=2, initial=-np.inf)
    return np.stack([begin, end], axis=2)
