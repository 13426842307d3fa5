"""Which of several fitted cylinders a surface is: by one noise in common, and by what else they might be. Compiled."""

import numpy as np
from numba import njit

from gripwright.domain.shape import FloatArray, IntArray
from gripwright_builtin.fitters.chance import EXACT
from gripwright_builtin.fitters.following import following
from gripwright_builtin.fitters.judgement import fading
from gripwright_builtin.fitters.patch import Patch
from gripwright_builtin.fitters.proposals import RADIUS, SIGN
from gripwright_builtin.fitters.refinement import CLEAN, FAR, FAR_OF_RADIUS, Refined

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
def nothing() -> Refined:
    """No cylinder."""
    return Refined(np.zeros(8), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def clear(patch: Patch, normals: FloatArray, chosen: IntArray, shares: FloatArray, one: Refined, share: float) -> bool:
    """Whether a long arc is clearly a cylinder, and so much of what faces across its axis follows it."""
    if one.pattern > _CLEAR_PATTERN or one.arc_rad < (_CLEAR_ARC if one.rms > EXACT else _EXACT_ARC):
        return False
    if one.bent < _CLEAR_BENT or one.rms > _CLEAR_RMS * one.cylinder[RADIUS]:
        return False
    around = 0.0
    for s in range(len(chosen)):
        f = chosen[s]
        tilt = normals[f, 0] * one.cylinder[3] + normals[f, 1] * one.cylinder[4] + normals[f, 2] * one.cylinder[5]
        if abs(tilt) < ACROSS:
            around += shares[s]
    return bool(one.area > share * around)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def weighed(patch: Patch, normals: FloatArray, chosen: IntArray, shares: FloatArray, found: list[Refined]) -> list[Refined]:
    """The same with scores for one noise in common, which is that of the best; what bends no more than noise counts less."""
    best, noise = 0.0, np.inf
    for one in found:
        if one.facet_rad > 0.0:
            best = max(best, one.worth * _firm(one))
    for one in found:
        if one.facet_rad > 0.0 and one.worth * _firm(one) >= _GOOD * best:
            noise = min(noise, max(one.rms, 10.0 * EXACT))
    kept = [nothing()][:0]
    for one in found:
        if one.score > 0.0:
            score = fading(patch, normals, chosen, shares, one.cylinder, noise) * _firm(one)
            kept.append(_with_score(one, score))
    return kept


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _with_score(one: Refined, score: float) -> Refined:
    return Refined(
        one.cylinder,
        one.rms,
        one.radius_sigma,
        one.axis_sigma_rad,
        one.facet_rad,
        one.bent,
        one.pattern,
        one.arc_rad,
        one.worth,
        one.area,
        score,
    )


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _firm(one: Refined) -> float:
    """1 where a plane is out of the question and the distances are but noise, least 0.005."""
    bent, random = one.bent / _BENT, (_PATTERN_MAX - one.pattern) / (_PATTERN_MAX - _PATTERN)
    return min(max(bent, 0.05), 1.0) * min(max(random, 0.1), 1.0)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def distinct(found: list[Refined], sign: float) -> list[Refined]:
    """The best of a sign, none of them the same as a better one."""
    kept = [nothing()][:0]
    left = np.array([one.score if one.cylinder[SIGN] == sign else 0.0 for one in found])
    while len(kept) < POLISHED and len(left) and left.max() > 0.0:
        at = int(np.argmax(left))
        left[at] = 0.0
        new = True
        for other in kept:
            new = new and not _same(found[at].cylinder, other.cylinder)
        if new:
            kept.append(found[at])
    return kept


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _same(a: FloatArray, b: FloatArray) -> bool:
    apart = b[:3] - a[:3]
    apart = apart - (apart @ a[3:6]) * a[3:6]
    off = np.sqrt(apart @ apart) + abs(a[RADIUS] - b[RADIUS])
    return bool(abs(a[3:6] @ b[3:6]) > 0.999 and off < 0.02 * a[RADIUS])


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def bulges(patch: Patch, normals: FloatArray, one: Refined, area: float) -> bool:
    """Whether a surface only touches an exact cylinder, as a sphere does: most of what is near leans away from its axis.

    `area` is that of the faces on the cylinder.
    """
    cylinder, faces = one.cylinder, np.arange(len(patch.faces))
    if one.rms > _TOUCHING * CLEAN * cylinder[RADIUS]:
        return False
    near = faces[following(patch, normals, faces, patch.areas, cylinder, min(FAR, FAR_OF_RADIUS * cylinder[RADIUS]))]
    lean, around = 0.0, patch.areas[near].sum()
    for f in near:
        tilt = normals[f, 0] * cylinder[3] + normals[f, 1] * cylinder[4] + normals[f, 2] * cylinder[5]
        lean += patch.areas[f] * abs(tilt)
    return bool(area < 0.5 * around and lean > _LEAN * around)
