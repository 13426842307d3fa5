"""How far bodies may grow before boxes that missed their bounding boxes would come near them."""

from dataclasses import dataclass

import numba
import numpy as np

from gripwright.domain.shape import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rooms:
    """A room for each of s bodies: a bounding box that lies in it, without touching its walls, is missed by all the boxes.

    A body that a box came near has none: its room is inside out.
    """

    low: FloatArray  # (s, 3)
    high: FloatArray  # (s, 3)

    def hold(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """Whether the bounding box of each body (s, 3) lies in its room, (s,)."""
        return np.asarray(((low > self.low) & (high < self.high)).all(axis=1))


def rooms(box_low: FloatArray, box_high: FloatArray, low: FloatArray, high: FloatArray) -> Rooms:
    """The rooms of bodies (s, 3) among closed boxes (n, 3). Of the sides on which a box misses a body, the farthest counts."""
    room = np.stack([np.full(low.shape, -np.inf), np.full(low.shape, np.inf)])
    _confine(box_low, box_high, low, high, room)
    return Rooms(low=room[0], high=room[1])


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _confine(box_low: FloatArray, box_high: FloatArray, low: FloatArray, high: FloatArray, room: FloatArray) -> None:
    for k in range(len(low)):
        for n in range(len(box_low)):
            widest, axis, side = -1.0, -1, 0
            for i in range(3):
                if box_high[n, i] < low[k, i] and low[k, i] - box_high[n, i] > widest:
                    widest, axis, side = low[k, i] - box_high[n, i], i, 0
                if box_low[n, i] > high[k, i] and box_low[n, i] - high[k, i] > widest:
                    widest, axis, side = box_low[n, i] - high[k, i], i, 1
            if axis < 0:  # it comes near
                room[0, k], room[1, k] = np.inf, -np.inf
                break
            if side == 0:
                room[0, k, axis] = max(room[0, k, axis], box_high[n, axis])
            else:
                room[1, k, axis] = min(room[1, k, axis], box_low[n, axis])
