"""How much of a surface about an axis is really there: its arc, and whether three fingers find it."""

import numpy as np

from gripwright.domain.shape import FloatArray
from gripwright.geometry.frames import any_perpendicular
from gripwright_builtin.shapes.patches import FlatPatches

_TURN = 2.0 * np.pi
_BINS = 36  # a multiple of three
_GAP_RAD = 0.03  # less is no gap
_ON_AXIS = 1e-3


def spans(patches: FlatPatches, point: FloatArray, axis: FloatArray) -> tuple[FloatArray, FloatArray]:
    """From where to where each patch reaches about an axis, rad from `any_perpendicular` of it, (k,) each."""
    x = any_perpendicular(axis)
    y = np.cross(axis, x)
    places, middles = patches.points - point, patches.centres - point
    middle = np.arctan2(middles @ y, middles @ x)
    beside = np.arctan2(places @ y, places @ x) - np.repeat(middle, patches.counts)
    beside = (beside + np.pi) % _TURN - np.pi
    beside[np.hypot(places @ x, places @ y) < _ON_AXIS] = 0.0  # an apex lies at every angle
    return middle + np.minimum.reduceat(beside, patches.start), middle + np.maximum.reduceat(beside, patches.start)


def arc(low: FloatArray, high: FloatArray) -> tuple[float, float]:
    """The least arc that holds all spans: where it begins and how far it goes, rad."""
    begin = np.mod(low, _TURN)
    order = np.argsort(begin, kind="stable")
    begin, width = begin[order], (high - low)[order]
    begins = np.concatenate([begin, begin + _TURN])  # two turns, so that spans across the zero count
    ends = np.maximum.accumulate(begins + np.concatenate([width, width]))
    gaps = (begins[1:] - ends[:-1])[len(begin) - 1 :]  # (k,) behind each span, over one turn
    widest = int(np.argmax(gaps))
    if gaps[widest] <= _GAP_RAD:
        return 0.0, _TURN
    return float(np.mod(begins[len(begin) + widest], _TURN)), float(_TURN - gaps[widest])


def three_finger_share(low: FloatArray, high: FloatArray, areas: FloatArray, whole: float) -> float:
    """Share of the surface that each of three fingers 120° apart finds at the best rotation, 0..1; `whole` is the full area."""
    edges = np.arange(_BINS) * _TURN / _BINS
    width = np.maximum(high - low, 1e-9)
    begin = np.mod(low, _TURN)[:, None] - _TURN * np.arange(2)  # (k, 2) a span across the zero counts at both ends
    overlap = np.zeros((len(low), _BINS))
    for k in range(2):
        start = begin[:, k : k + 1]
        overlap += np.clip(np.minimum(start + width[:, None], edges + _TURN / _BINS) - np.maximum(start, edges), 0.0, None)
    cover = (areas / width) @ overlap / (whole / _BINS)  # (bins,)
    third = np.minimum(cover.reshape(3, -1).min(axis=0), 1.0)
    return float(third.max())
