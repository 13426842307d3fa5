"""Which of several fitted cylinders a surface is: by one noise in common, and by what else they might be. Compiled."""

import numpy as np
from numba import njit

from gripwright.domain.shape import FloatArray, IntArray
from gripwright_builtin.fitters.chance import EXACT
from gripwright_builtin.fitters.following import following
from gripwright_builtin.fitters.judgement import fading
from gripwright_builtin.fitters.patch import Patch
from gripwright_builtin.fitters.proposals import RADIUS, SIGN
from gripwright_builtin.fitters.refinement import (
    ARC,
    AREA,
    BENT,
    CLEAN,
    FACET,
    FAR,
    FAR_OF_RADIUS,
    PATTERN,
    RMS,
    SCORE,
    WORTH,
)

ACROSS = 0.9  # of a normal along the axis: an end face
POLISHED = 2  # of each sign
_GOOD = 0.7  # of the best worth: cylinders that may tell the noise
_BENT = 12.0  # squared standard deviations by which a plane must be worse
_PATTERN, _PATTERN_MAX = 0.4, 0.8  # correlation of neighbours' distances: from noise to another shape
_CLEAR_PATTERN = 0.25
_CLEAR_BENT = 400.0
_CLEAR_RMS = 0.02
_CLEAR_ARC, _EXACT_ARC = float(np.radians(75.0)), float(np.radians(15.0))
_TOUCHING = 3.0  # times the deviation of a clean surface
_LEAN = 0.1  # mean part of the normals along the axis


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def clear(patch: Patch, normals: FloatArray, chosen: IntArray, shares: FloatArray, one: FloatArray, share: float) -> bool:
    """Whether a long arc is clearly a cylinder, and so much of what faces across its axis follows it."""
    if one[PATTERN] > _CLEAR_PATTERN or one[ARC] < (_CLEAR_ARC if one[RMS] > EXACT else _EXACT_ARC):
        return False
    if one[BENT] < _CLEAR_BENT or one[RMS] > _CLEAR_RMS * one[RADIUS]:
        return False
    around = 0.0
    for s in range(len(chosen)):
        f = chosen[s]
        tilt = normals[f, 0] * one[3] + normals[f, 1] * one[4] + normals[f, 2] * one[5]
        if abs(tilt) < ACROSS:
            around += shares[s]
    return bool(one[AREA] > share * around)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def weigh(patch: Patch, normals: FloatArray, chosen: IntArray, shares: FloatArray, found: FloatArray) -> None:
    """New scores for one noise in common, which is that of the best; what bends no more than noise counts less."""
    best, noise = 0.0, np.inf
    for k in range(len(found)):
        if found[k, FACET] > 0.0:
            best = max(best, found[k, WORTH] * _firm(found[k]))
    for k in range(len(found)):
        if found[k, FACET] > 0.0 and found[k, WORTH] * _firm(found[k]) >= _GOOD * best:
            noise = min(noise, max(found[k, RMS], 10.0 * EXACT))
    for k in range(len(found)):
        found[k, SCORE] = fading(patch, normals, chosen, shares, found[k], noise) * _firm(found[k])


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _firm(one: FloatArray) -> float:
    """1 where a plane is out of the question and the distances are but noise, least 0.005."""
    bent, random = one[BENT] / _BENT, (_PATTERN_MAX - one[PATTERN]) / (_PATTERN_MAX - _PATTERN)
    return float(min(max(bent, 0.05), 1.0) * min(max(random, 0.1), 1.0))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def distinct(found: FloatArray) -> IntArray:
    """The best of either sign, none of them the same as a better one."""
    kept, count = np.empty(2 * POLISHED, np.int64), 0
    for sign in (1.0, -1.0):
        left, first = np.where(found[:, SIGN] == sign, found[:, SCORE], 0.0), count
        while count < first + POLISHED and len(left) and left.max() > 0.0:
            at = int(np.argmax(left))
            left[at] = 0.0
            new = True
            for k in range(first, count):
                new = new and not _same(found[at], found[kept[k]])
            if new:
                kept[count] = at
                count += 1
    return kept[:count]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _same(a: FloatArray, b: FloatArray) -> bool:
    apart = b[:3] - a[:3]
    apart = apart - (apart @ a[3:6]) * a[3:6]
    off = np.sqrt(apart @ apart) + abs(a[RADIUS] - b[RADIUS])
    return bool(abs(a[3:6] @ b[3:6]) > 0.999 and off < 0.02 * a[RADIUS])


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def bulges(patch: Patch, normals: FloatArray, cylinder: FloatArray, area: float) -> bool:
    """Whether a surface only touches an exact cylinder, as a sphere does: most of what is near leans away from its axis.

    `area` is that of the faces on the cylinder.
    """
    faces = np.arange(len(patch.faces))
    if cylinder[RMS] > _TOUCHING * CLEAN * cylinder[RADIUS]:
        return False
    near = faces[following(patch, normals, faces, patch.areas, cylinder, min(FAR, FAR_OF_RADIUS * cylinder[RADIUS]))]
    lean, around = 0.0, patch.areas[near].sum()
    for f in near:
        tilt = normals[f, 0] * cylinder[3] + normals[f, 1] * cylinder[4] + normals[f, 2] * cylinder[5]
        lean += patch.areas[f] * abs(tilt)
    return bool(area < 0.5 * around and lean > _LEAN * around)
