"""The finger lengths for which a grasp is free: L⁻ from what comes before the palm, L⁺ from what comes behind the tips.

A palm that moves back, and a stem that ends sooner, hold less and less of the space that they passed through before: the bound is
where the last triangle is left (`geometry/triangle_blocks`).
"""

import numpy as np

from gripwright.design.hand_check import ENTER_MM, LENGTH_LIMIT_MM, HandCheck, Miss
from gripwright.domain.grasp import Grasp
from gripwright.domain.shape import FloatArray
from gripwright.geometry.polytope import Faces
from gripwright.geometry.withdrawal import Shrinking, shortened, standing, withdrawn

_Touch = tuple[float, str | None]  # how far, and what
_BACK = np.array([0.0, 0.0, -1.0])  # frames F and G
_OFF_MM = 0.004  # a bound keeps off the exact one by this, within the 0.01 mm to which it is stated


def length_min(check: HandCheck, grasp: Grasp, envelopes_mm: FloatArray, tips_mm: float) -> tuple[FloatArray, Miss | None]:
    """L⁻ for each palm envelope (ascending), at least `tips_mm`; inf, and what the palm hits, where no length helps."""
    result = np.full(len(envelopes_mm), np.inf)
    touched, body = _last_palm_touch(check, grasp, float(envelopes_mm[0]), max(tips_mm, 1.0))
    result[0] = max(tips_mm, 1.0, touched + _OFF_MM)
    if result[0] > LENGTH_LIMIT_MM:
        result[0] = np.inf
        detail = f"the palm hits {body} with fingers of {LENGTH_LIMIT_MM:.0f} mm too"
        return result, Miss(stage=4, code="collision", detail=detail)
    spans = [(0, len(envelopes_mm) - 1)]
    if len(envelopes_mm) > 1:
        result[-1] = _length_from(check, grasp, float(envelopes_mm[-1]), float(result[0]))
    while spans:  # what is free for a large palm is free for a small one
        small, large = spans.pop()
        if large - small < 2:
            continue
        if result[large] == result[small] or result[large] - result[small] <= _OFF_MM:
            result[small + 1 : large] = result[large]
            continue
        middle = (small + large) // 2
        result[middle] = _length_from(check, grasp, float(envelopes_mm[middle]), float(result[small]))
        spans += [(small, middle), (middle, large)]
    return result, None


def length_max(check: HandCheck, grasp: Grasp, length_min_mm: float) -> tuple[float, Miss | None]:
    """L⁺ ≥ L⁻, inf where `LENGTH_LIMIT_MM` is still free; or why stems of L⁻ are not."""
    if check.seated(grasp, LENGTH_LIMIT_MM) is None:
        return float("inf"), None
    miss = check.seated(grasp, length_min_mm)
    if miss is not None:
        return length_min_mm, miss
    shorter, _ = _last_stem_touch(check, grasp, LENGTH_LIMIT_MM - length_min_mm)
    return max(length_min_mm, LENGTH_LIMIT_MM - shorter - _OFF_MM), None


def palm_hit(check: HandCheck, grasp: Grasp, envelope_mm: float, finger_length_mm: float) -> str | None:
    """What the palm of that envelope hits along the whole operation behind fingers of that length, or None."""
    return _last_palm_touch(check, grasp, envelope_mm, finger_length_mm)[1]


def _length_from(check: HandCheck, grasp: Grasp, envelope_mm: float, low_mm: float) -> float:
    """L⁻, at least `low_mm`; inf where no length helps."""
    length_mm = max(low_mm, _last_palm_touch(check, grasp, envelope_mm, low_mm)[0] + _OFF_MM)
    return length_mm if length_mm <= LENGTH_LIMIT_MM else float("inf")


def _last_palm_touch(check: HandCheck, grasp: Grasp, envelope_mm: float, low_mm: float) -> _Touch:
    """The greatest finger length from `low_mm` on at which the palm touches something along the whole operation; −inf: none."""
    scene = check.scene
    last: _Touch = (-np.inf, None)
    X_PG = scene.X_PC @ grasp.X_CG

    def moved_back(faces: Faces) -> Shrinking:
        return withdrawn(faces, _BACK, LENGTH_LIMIT_MM, low_mm)

    for solid, way_out in check.palm(envelope_mm):
        out = moved_back(way_out)
        for among, X in ((scene.attached, grasp.X_CG), *((scene.standing, place @ X_PG) for place in check.ends)):
            last = _later(last, among.last_touch(out, standing(X), max(last[0], low_mm), LENGTH_LIMIT_MM))
        span = (max(last[0], low_mm), LENGTH_LIMIT_MM)
        last = _later(last, check.sweeps.last_touch(scene.standing, solid, X_PG, moved_back, span))
    return last


def _last_stem_touch(check: HandCheck, grasp: Grasp, end_mm: float) -> _Touch:
    """By how much, up to `end_mm`, stems of `LENGTH_LIMIT_MM` have to be shortened until they touch nothing more; −inf: none."""
    scene = check.scene
    last: _Touch = (-np.inf, None)
    for X_GF in check.hand.finger_poses(grasp.opening_width_mm):
        X_CF = grasp.X_CG @ X_GF
        X_PF = scene.X_PC @ X_CF
        for vertices in check.finger(grasp, LENGTH_LIMIT_MM):
            if vertices[:, 2].min() > _OFF_MM - LENGTH_LIMIT_MM:
                continue  # a cup stays as it is, however long the stem behind it
            closing = check.sweeps.polytope(check.closing(grasp, vertices, ENTER_MM), 0.0)
            opening = check.sweeps.polytope(check.opening(grasp, vertices), scene.margin_mm)
            places = ((scene.attached, closing, X_CF), *((scene.standing, opening, place @ X_PF) for place in check.ends))
            for among, solid, X in places:
                last = _later(last, among.last_touch(_shortened(solid.faces), standing(X), max(last[0], 0.0), end_mm))
            moving, span = check.sweeps.polytope(vertices, scene.margin_mm), (max(last[0], 0.0), end_mm)
            last = _later(last, check.sweeps.last_touch(scene.standing, moving, X_PF, _shortened, span))
    return last


def _later(one: _Touch, other: _Touch) -> _Touch:
    return other if other[0] > one[0] else one


def _shortened(faces: Faces) -> Shrinking:
    return shortened(faces, _BACK)
