"""The least distance along a motion between something that moves and what stands still."""

import heapq
from collections.abc import Callable
from itertools import pairwise

import numpy as np

from gripwright.design.motion import divided, sampled
from gripwright.domain.shape import FloatArray

_POSES = 24  # along the motion, to begin with
_HALVINGS = 80  # of stretches between them, at the most
_FINE_MM = 0.02


def least_gap_mm(
    motion: FloatArray, X_PB: FloatArray, corners_B: FloatArray, distance_mm: Callable[[FloatArray, float], float]
) -> float:
    """The least of `distance_mm` (pose of B in the product frame, limit beyond which it need not be told) along the motion.

    `corners_B` (n, 3) hold all that moves with frame B, which stands at D · X_PB when the subassembly is displaced by D. Between
    two poses nothing comes nearer than half of what their distances leave after the way between them; where that is nearer
    than the nearest pose, the stretch is halved, the most promising first, until none may be nearer by `_FINE_MM`.
    """
    places = [place @ X_PB for place in sampled(motion, _POSES)]
    ways = [_way_mm(start, end, corners_B) for start, end in pairwise(places)]
    best, widest = np.inf, max(ways, default=0.0)
    told = []
    for place in places[::-1]:  # from the end, where things are close
        told.append(distance_mm(place, best + widest))
        best = min(best, told[-1])
    told.reverse()
    waiting = [
        ((first + second - way) / 2.0, number, way, (start, first), (end, second))
        for number, (way, start, first, end, second) in enumerate(
            zip(ways, places[:-1], told[:-1], places[1:], told[1:], strict=True)
        )
    ]
    heapq.heapify(waiting)
    for number in range(_HALVINGS):
        if not waiting or waiting[0][0] >= best - _FINE_MM:
            break
        _, _, way, (start, first), (end, second) = heapq.heappop(waiting)
        middle = divided(start, end, 2)[0]
        here = distance_mm(middle, best + way)
        best = min(best, here)
        for k, (one, other) in enumerate((((start, first), (middle, here)), ((middle, here), (end, second)))):
            bound = (one[1] + other[1] - way / 2.0) / 2.0
            heapq.heappush(waiting, (bound, len(ways) + 2 * number + k, way / 2.0, one, other))
    return float(best)


def _way_mm(start: FloatArray, end: FloatArray, corners_B: FloatArray) -> float:
    """How far a corner goes at the most between two poses that are less than a half turn apart."""
    turned = np.clip((np.trace(start[:3, :3].T @ end[:3, :3]) - 1.0) / 2.0, -1.0, 1.0)
    half = np.arccos(turned) / 2.0
    chord = np.linalg.norm(corners_B @ (end - start)[:3, :3].T + (end - start)[:3, 3], axis=1).max()
    return float(chord * (half / np.sin(half) if half > 1e-6 else 1.0))
