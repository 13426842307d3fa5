"""The cylinders that a segment's surface follows: consensus proposes, least squares on the true corners decides."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from gripwright.domain.shape import FloatArray, IntArray, Mesh
from gripwright.geometry.surfaces import CylinderFit
from gripwright_builtin.fitters.chance import EXACT
from gripwright_builtin.fitters.lateral import Lateral, lateral_surface
from gripwright_builtin.fitters.osculation import osculating
from gripwright_builtin.fitters.patch import Patch, patch_of, smooth_normals
from gripwright_builtin.fitters.proposals import (
    RADIUS,
    SIGN,
    chance,
    closeness,
    directions_of,
    picked,
    propose,
    sample,
    support,
    voices,
)
from gripwright_builtin.fitters.refinement import AREA, CLEAN, FACET, FAR, RMS, SCORE, WIDTH, refine, tolerance
from gripwright_builtin.fitters.weighing import ACROSS, POLISHED, bulges, clear, distinct, weigh

_DRAWN = 700  # faces that the search looks at
_CORNERED = 300  # more for their true corners
_HYPOTHESES = 600
_TRIES = 3  # cylinders looked for, of each sign
_LOOKS = ((12, 0, 1), (36, 4, _TRIES), (36, 4, 2))
"""Pairs of faces, planes taken as end faces and tries of a first look, of one at exact normals, of one at smooth ones."""
_FOUND = 24
_CLEAN_SHARE = 0.1  # of the drawn area that must be without noise for the segment to count as clean
_LEFT = 0.01  # of the area: less is not worth a cylinder
_WIDER = 3.0  # times as far may surface lie that carries noise
_UNKNOWN, _NOISY, _CLEAN, _SURE = 0, 1, 2, 3  # what a surface is: with noise, without, of one cylinder alone
_SURE_SHARE, _CLEAR_SHARE = 0.8, 0.5  # of what faces across the axis: no room for another cylinder, or for a better axis


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FoundCylinder:
    """A cylinder, whether the surface faces away from its axis (+1) or towards it (−1), and the surface that follows it."""

    fit: CylinderFit
    sign: float
    area_mm2: float  # of the faces on it
    low_mm: float  # their extent along the axis, from the fit's point
    high_mm: float
    arc_rad: float
    filled: float  # share of the lateral area between low and high, 0..1
    three_finger: float  # share of the height that each of three fingers 120° apart finds at the best rotation, 0..1
    around_mm2: float  # area of the segment without end faces
    score: float  # area of the surface times the digits of its closeness


def find_cylinders(mesh: Mesh, ids: IntArray, rng: np.random.Generator) -> list[FoundCylinder]:
    """The cylinders that faces `ids` follow, both signs; the best first, the score being the judge."""
    origin_mm, size_mm, rows = _search(mesh.vertices_mm, mesh.faces, ids, int(rng.integers(1 << 62)))
    return sorted((_found(row, origin_mm, size_mm) for row in rows), key=lambda one: -one.score)


def _found(row: FloatArray, origin_mm: FloatArray, size_mm: float) -> FoundCylinder:
    radius, sign, rms, radius_sigma, axis_sigma, area, low, high, arc, filled, three_finger, around, score = row[6:].tolist()
    return FoundCylinder(
        fit=CylinderFit(
            point_mm=row[:3] * size_mm + origin_mm,
            axis=row[3:6],
            radius_mm=radius * size_mm,
            rms_mm=rms * size_mm,
            radius_sigma_mm=radius_sigma * size_mm,
            axis_sigma_rad=axis_sigma,
        ),
        sign=sign,
        area_mm2=area * size_mm**2,
        low_mm=low * size_mm,
        high_mm=high * size_mm,
        arc_rad=arc,
        filled=filled,
        three_finger=three_finger,
        around_mm2=around * size_mm**2,
        score=score,
    )


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _search(vertices_mm: FloatArray, mesh_faces: IntArray, ids: IntArray, seed: int) -> tuple[FloatArray, float, FloatArray]:
    """Origin and size of the segment, and a row a cylinder (see `_found`)."""
    patch = patch_of(vertices_mm, mesh_faces, ids)
    rows = np.empty((2 * POLISHED, 19))
    state = np.array([np.uint64(seed)])
    directions, count = directions_of(patch.normals, patch.areas)
    if count == 0:
        return patch.origin_mm, patch.size_mm, rows[:0]
    running = voices(patch.areas, directions, count)
    chosen, shares = _drawn(state, patch, running)
    hypotheses, found = np.empty((_HYPOTHESES, SIGN + 1)), np.empty((_FOUND, WIDTH))
    normals, far, number, taken, answer = patch.normals, FAR, 0, 0, _UNKNOWN
    for pairs, caps, tries in _LOOKS:
        if answer in (_SURE, _CLEAN):
            break
        if answer == _NOISY:
            normals, far = smooth_normals(patch), _WIDER * FAR
            directions, count = directions_of(normals, patch.areas)
            running = voices(patch.areas, directions, count)
        number += propose(state, patch, normals, directions, running, pairs, caps, hypotheses[number:])
        answer, taken = _tried(state, patch, normals, running, chosen, shares, hypotheses[:number], far, tries, found)
    if far > FAR and answer != _SURE:
        short = True  # arc, perhaps; a long one needs no other way to be found
        for k in range(taken):
            short = short and not clear(patch, normals, chosen, shares, found[k], _CLEAR_SHARE)
        starts = osculating(patch, normals, chosen, shares, _TRIES if short else 0, far)
        for h in range(len(starts)):
            taken += refine(patch, normals, chosen, shares, starts[h], far, found[taken])
        weigh(patch, normals, chosen, shares, found[:taken])
    count = 0
    for k in distinct(found[:taken]):
        count += _row(patch, normals, chosen, found[k], far, rows[count])
    return patch.origin_mm, patch.size_mm, rows[:count]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _drawn(state: IntArray, patch: Patch, running: FloatArray) -> tuple[IntArray, FloatArray]:
    """The faces that the search looks at, ascending, and the area that each stands for.

    Some more, which stand for none, are there for their true corners: a fine tessellation has these at its edges alone.
    """
    if len(patch.faces) <= _DRAWN:
        return np.arange(len(patch.faces)), patch.areas
    times = np.zeros(len(patch.faces))
    for _ in range(_DRAWN):
        times[picked(state, running)] += 1.0
    cornered = np.zeros(len(patch.faces), np.bool_)
    for f in range(len(patch.faces)):
        for k in range(3):
            cornered[f] = cornered[f] or patch.corner[patch.faces[f, k]]
    more = np.flatnonzero(cornered)
    which = times > 0.0
    which[more[:: len(more) // _CORNERED + 1]] = True
    chosen = np.flatnonzero(which)
    shares = np.zeros(len(chosen))
    for s in range(len(chosen)):
        if times[chosen[s]] > 0.0:
            shares[s] = patch.areas[chosen[s]] / (1.0 - (1.0 - chance(running, chosen[s])) ** _DRAWN)
    return chosen, shares


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _tried(
    state: IntArray,
    patch: Patch,
    normals: FloatArray,
    running: FloatArray,
    chosen: IntArray,
    shares: FloatArray,
    hypotheses: FloatArray,
    far: float,
    tries: int,
    found: FloatArray,
) -> tuple[int, int]:
    """Write to `found` cylinders of both signs, each the best explanation of what the earlier ones of its sign left over.

    Returns what the surface is, and how many. Where the very best cylinder has noise, or is all there is, no other is looked for.
    """
    faces, areas = sample(state, patch.areas, running)
    wide = far / FAR
    bounds, top = np.empty(len(hypotheses)), 0.0
    for h in range(len(hypotheses)):
        bounds[h] = support(patch, normals, faces, areas, hypotheses[h], wide, 0.5 * top)
        top = max(top, bounds[h])
    enough, total, answer, taken = _CLEAN_SHARE * shares.sum(), areas.sum(), _NOISY, 0
    first = hypotheses[np.argmax(bounds), SIGN] if len(bounds) else 1.0
    order = np.argsort(-bounds)
    for sign in (first, -first):
        weights = areas.copy()
        for again in range(tries):
            best = _best(
                patch, normals, faces, weights if again else weights[:0], hypotheses, bounds, order, sign, _LEFT * total, wide
            )
            if best < 0:
                break
            one = found[taken]
            good = refine(patch, normals, chosen, shares, hypotheses[best], far, one)
            _explain(patch, normals, faces, weights, hypotheses[best], wide)
            bounds[best] = 0.0
            if good:
                taken += 1
                if clear(patch, normals, chosen, shares, one, _SURE_SHARE):
                    found[0] = one
                    return _SURE, 1
                _explain(patch, normals, faces, weights, one, wide)
                if one[RMS] < CLEAN * min(one[RADIUS], 1.0) and one[AREA] > enough:
                    answer = _CLEAN
            if tries == 1:
                return _UNKNOWN, taken
            if wide == 1.0 and answer == _NOISY:
                return _NOISY, taken
    return answer, taken


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _best(
    patch: Patch,
    normals: FloatArray,
    faces: IntArray,
    weights: FloatArray,
    hypotheses: FloatArray,
    bounds: FloatArray,
    order: IntArray,
    sign: float,
    least: float,
    wide: float,
) -> int:
    """The hypothesis of a sign with most support, −1 where none has more than `least`.

    Support only shrinks: what is known of it from before bounds it. No weights: the bounds are the support.
    """
    best, most = -1, least
    for h in order:
        if hypotheses[h, SIGN] == sign and bounds[h] > most:
            if len(weights):
                bounds[h] = support(patch, normals, faces, weights, hypotheses[h], wide, most)
            if bounds[h] > most:
                best, most = h, bounds[h]
    return best


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _explain(patch: Patch, normals: FloatArray, faces: IntArray, weights: FloatArray, cylinder: FloatArray, wide: float) -> None:
    """Take from the samples what follows a cylinder."""
    for s in range(len(faces)):
        if weights[s] > 0.0 and closeness(patch, normals, faces[s], cylinder, wide) > 0.0:
            weights[s] = 0.0


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _row(patch: Patch, normals: FloatArray, chosen: IntArray, rough: FloatArray, far: float, row: FloatArray) -> bool:
    """The same on the whole segment, with the surface that follows it; False where that surface is a prism's."""
    fit = rough
    if len(chosen) < len(patch.faces) and not rough[RMS] < 10.0 * EXACT:  # else more points would tell nothing
        fit = np.empty(WIDTH)
        refine(patch, normals, np.arange(len(patch.faces)), patch.areas, rough, far, fit)
    if not fit[SCORE] > 0.0 or not fit[FACET] > 0.0:
        return False
    on: Lateral = lateral_surface(patch, normals, fit, tolerance(fit, fit[RMS]), fit[FACET], fit[RMS])
    if not on.area > 0.0 or bulges(patch, normals, fit, on.area):
        return False
    around = 0.0
    for f in range(len(patch.faces)):
        if abs(normals[f, 0] * fit[3] + normals[f, 1] * fit[4] + normals[f, 2] * fit[5]) < ACROSS:
            around += patch.areas[f]
    row[:FACET] = fit[:FACET]
    row[11], row[12], row[13], row[14], row[15], row[16] = on.area, on.low, on.high, on.arc_rad, on.filled, on.three_finger
    row[17], row[18] = around, fit[SCORE]
    return True
