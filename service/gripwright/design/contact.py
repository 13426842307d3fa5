"""Where the fingers of a grasp touch the component: seating, contact patches, forbidden surface. Lengths in mm.

INTERFACE.md, "Touch": gap at most 0.05 mm, surfaces within 5° of parallel along a contact at least `min_contact` high along
the gripper's z. A little is kept in reserve, so that whoever measures the finished CAD finds the contact too.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from gripwright.design.face import forbidden_faces
from gripwright.design.gripping_surface import Flat, GrippingSurface, gripping_surface
from gripwright.design.tapered_hand import vee_of
from gripwright.domain.affordance import Forbidden
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import SURFACE, Grasp
from gripwright.domain.holding import Contact
from gripwright.domain.shape import FloatArray
from gripwright.domain.v_tip import Vee
from gripwright.geometry.clipping import clip_to_box, longest_run
from gripwright.geometry.frames import inverse, transform
from gripwright.geometry.held_surface import PARALLEL_RAD, SEAT_MM, TOUCH_GAP_MM, Surface
from gripwright.plugin_api import HandModel

_SEARCH_MM = 0.5  # how far the seated surface may lie from the planned one
_DEPTH_MM = 60.0  # surface farther outside the finger's plane is not looked at
SPREAD_MM = TOUCH_GAP_MM - SEAT_MM  # by so much three fingers, or the two pairs of four, may differ in where they touch


def seat(grasp: Grasp, surface: Surface, hand: HandModel) -> Grasp | Rejection:
    """The grasp with the opening (and, for two fingers, the centre) at which the fingers just touch the component."""
    sign = gripping_surface(hand, grasp.grip).sign
    found: list[list[float]] = []
    for number in range(hand.fingers):
        met = [level for level in _levels_mm(grasp, number, surface, hand) if level is not None]
        if len(met) < _zones(hand, grasp.grip):
            part = "meets" if _zones(hand, grasp.grip) == 1 else "meets with one flank"
            return Rejection("no-contact", f"finger {number + 1} {part} no surface within {_SEARCH_MM} mm of the opening width")
        found.append(met)
    shift_G, levels = _centred(found, hand)
    spread = max(levels) - min(levels)
    if spread > SPREAD_MM:
        return Rejection("no-contact", f"one finger stays {spread:.3f} mm off the surface, at most {TOUCH_GAP_MM} mm")
    X_CG = grasp.X_CG.copy()
    X_CG[:3, 3] += X_CG[:3, :3] @ (sign * shift_G)
    width = grasp.opening_width_mm + 2.0 * sign * (max(levels) + SEAT_MM)
    return replace(grasp, X_CG=X_CG, opening_width_mm=float(width))


def _zones(hand: HandModel, grip: str) -> int:
    return len(gripping_surface(hand, grip).zones)


def _centred(found: Sequence[Sequence[float]], hand: HandModel) -> tuple[FloatArray, list[float]]:
    """How a hand moves (3,) so that opposite fingers lie equally deep, and how deep they all lie then, finger by finger.

    Two fingers, and four, centre what they hold between them; three stand as they are. A V centres it across, too.
    """
    vee = vee_of(hand)
    if vee is not None:
        return _centred_in_v(np.array(found), 1.0 / np.tan(vee.angle_rad / 2.0))
    levels = [level for (level,) in found]
    pairs = len(levels) // 2 if len(levels) in (2, 4) else 0
    shift_G, centred = np.zeros(3), list(levels)
    for k in range(pairs):  # along the gripper's x, then its y
        shift_G[k] = (levels[k] - levels[k + pairs]) / 2.0
        centred[k] = centred[k + pairs] = (levels[k] + levels[k + pairs]) / 2.0
    return shift_G, centred


def _centred_in_v(levels: FloatArray, rise: float) -> tuple[FloatArray, list[float]]:
    """The same for flanks (2, 2) of two fingers that recede by `rise` a mm aside; finger 2 is turned by 180°."""
    sides = np.array([[-1.0, 1.0], [1.0, -1.0]])  # of the gripper's y, on which each flank lies
    along = float(levels[0].mean() - levels[1].mean()) / 2.0
    aside = float((sides * levels).mean())
    left = levels - along * np.array([[1.0], [-1.0]]) - aside * sides
    return np.array([along, aside / rise, 0.0]), left.ravel().tolist()


def standing_off_mm(grasp: Grasp, surface: Surface, hand: HandModel) -> list[float | None]:
    """How far each finger stays off the surface when the first one touches it; None: it meets no surface at all."""
    found = [_levels_mm(grasp, number, surface, hand) for number in range(hand.fingers)]
    met = [[level for level in levels if level is not None] for levels in found]
    zones = _zones(hand, grasp.grip)
    if all(len(levels) == zones for levels in met):
        _, centred = _centred(met, hand)
        by_finger = [centred[start : start + zones] for start in range(0, len(centred), zones)]
        return [max(centred) - min(levels) for levels in by_finger]
    foremost = max((level for levels in met for level in levels), default=0.0)
    return [foremost - min(levels) if len(levels) == zones else None for levels in met]


def _levels_mm(grasp: Grasp, number: int, surface: Surface, hand: HandModel) -> list[float | None]:
    """How far a finger has to move outwards to touch the surface, negative inwards, with each flank of a V by itself.

    None where there is none to touch.
    """
    gripping = gripping_surface(hand, grasp.grip)
    y_low, y_high = gripping.y_range
    x_range = np.sort(gripping.sign * np.array([-_SEARCH_MM, _DEPTH_MM]))
    X_GF = hand.finger_poses(grasp.opening_width_mm)[number]
    if gripping.v is not None:
        back, X_CF = -gripping.v.height_mm, grasp.X_CG @ X_GF
        halves = [
            (np.array([x_range[0], *low]), np.array([x_range[1], *high]))
            for low, high in (((y_low, back), (0.0, 0.0)), ((0.0, back), (y_high, 0.0)))
        ]
        return [_level_mm(gripping.depths_mm(surface.within(X_CF, low, high))) for low, high in halves]
    low, high = np.array([x_range[0], y_low, -gripping.reach_mm(np.inf)]), np.array([x_range[1], y_high, 0.0])
    X_GP = X_GF @ gripping.X_FP
    level = _level_mm(gripping.depths_mm(surface.within(grasp.X_CG @ X_GP, low, high)))
    return [None if level is None else level / gripping.slope]


def _level_mm(depths_mm: FloatArray) -> float | None:
    """The greatest depth that is near the planned one."""
    near = depths_mm[depths_mm <= _SEARCH_MM]
    return float(near.max()) if near.size and near.max() >= -_SEARCH_MM else None


def contacts(
    grasp: Grasp, surface: Surface, hand: HandModel, finger_length_mm: float, min_contact_mm: float
) -> tuple[Contact, ...] | Rejection:
    """The contact of each finger of a seated grasp, of one with a V that of each flank, or why one does not touch as it must."""
    needed, gripping = needed_height_mm(grasp, surface, min_contact_mm), gripping_surface(hand, grasp.grip)
    found = []
    for number, X_GF in enumerate(hand.finger_poses(grasp.opening_width_mm), start=1):
        X_CF = grasp.X_CG @ X_GF
        for flats in gripping.zones:
            touching = _touching(surface, X_CF, gripping, flats, finger_length_mm)
            run = _run_mm(touching) * gripping.slope
            if run < needed - 1e-6:
                part = f"finger {number}" if gripping.v is None else f"a flank of finger {number}"
                return Rejection("no-contact", f"{part} touches along {run:.2f} mm of parallel surface, at least {needed:.2f} mm")
            contact = _contact(touching, run, gripping.sign)
            found.append(contact if gripping.v is None else _on_flank(contact, X_CF, gripping.v.vee))
    return tuple(found)


def _on_flank(contact: Contact, X_CF: FloatArray, vee: Vee) -> Contact:
    """The contact of a flank with which way its finger closes, and how wide it may become: up to the nearer end of the flank."""
    aside = abs(float(transform(inverse(X_CF), contact.centre_C[None])[0, 1]))
    nearer = max(min(aside, vee.width_mm / 2.0 - aside), 0.0)
    return replace(contact, closing_C=-X_CF[:3, 0], room_mm=float(2.0 * nearer / np.cos(vee.turn_rad)))


def needed_height_mm(grasp: Grasp, surface: Surface, min_contact_mm: float) -> float:
    """How high a contact has to be: the least contact, or the component's whole height where it is lower."""
    return min(min_contact_mm, float(np.ptp(surface.vertices @ grasp.X_CG[:3, 2])))


def contact_heights_mm(grasp: Grasp, surface: Surface, hand: HandModel, finger_length_mm: float) -> list[float]:
    """Along how much of its height each finger of a seated grasp touches the surface, of a V its lesser flank, 0: nowhere."""
    gripping = gripping_surface(hand, grasp.grip)
    poses = [grasp.X_CG @ X_GF for X_GF in hand.finger_poses(grasp.opening_width_mm)]
    return [
        min(_run_mm(_touching(surface, X_CF, gripping, flats, finger_length_mm)) * gripping.slope for flats in gripping.zones)
        for X_CF in poses
    ]


def _run_mm(touching: Sequence[tuple[FloatArray, FloatArray]]) -> float:
    """How far contact reaches along the gripping surface without a break."""
    z = [np.stack([patch[..., 2].min(axis=1), patch[..., 2].max(axis=1)], axis=1) for _, patch in touching]
    return longest_run(np.concatenate([np.empty((0, 2)), *z]), join=1e-4)


def _touching(
    surface: Surface, X_CF: FloatArray, gripping: GrippingSurface, flats: Sequence[Flat], finger_length_mm: float
) -> list[tuple[FloatArray, FloatArray]]:
    """Those flats of the finger that touch: frame (4, 4) of each seen from C, and the triangles (k, 3, 3) in that frame."""
    patches = []
    for flat in flats:
        X_CP = X_CF @ flat.X_FP
        parallel = surface.normals @ (gripping.sign * X_CP[:3, 0]) >= np.cos(PARALLEL_RAD - flat.rounding_rad)
        if not parallel.any():
            continue
        if gripping.v is None:
            low = np.array([-TOUCH_GAP_MM, -flat.width_mm / 2.0, -gripping.reach_mm(finger_length_mm)])
            high = np.array([TOUCH_GAP_MM, flat.width_mm / 2.0, 0.0])
            patch = surface.within(X_CP, low, high, parallel)
        else:
            patch = gripping.flank_patch(flat, surface, X_CF, finger_length_mm, parallel, TOUCH_GAP_MM)
        if len(patch):
            patches.append((X_CP, patch))
    return patches


def _contact(touching: Sequence[tuple[FloatArray, FloatArray]], height_mm: float, sign: float) -> Contact:
    """The contact of a finger, with the mean normal of its touching flats, by area."""
    areas = [np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1) / 2.0 for _, p in touching]
    centres = np.concatenate([transform(X_CP, patch.mean(axis=1)) for X_CP, patch in touching])
    totals = np.array([area.sum() for area in areas])
    normal = (totals + 1e-12) @ np.array([X_CP[:3, 0] for X_CP, _ in touching])
    return Contact(
        height_mm=height_mm,
        area_mm2=float(totals.sum()),
        centre_C=np.average(centres, axis=0, weights=np.concatenate(areas) + 1e-12),
        normal_C=sign * normal / np.linalg.norm(normal),
        gap_mm=min(float(-(sign * patch[..., 0]).max()) for _, patch in touching),
    )


def forbidden_touch(
    grasp: Grasp, regions: Sequence[tuple[Forbidden, Surface]], hand: HandModel, finger_length_mm: float
) -> Rejection | None:
    """Why the grasp would touch surface that must not be touched, or None. Each region comes with its own triangles."""
    for number, region, _ in forbidden_reaches(grasp, regions, hand, finger_length_mm):
        return Rejection("no-grasp", f"finger {number} would touch {region.reason}, which must not be touched")
    return None


def forbidden_reaches(
    grasp: Grasp, regions: Sequence[tuple[Forbidden, Surface]], hand: HandModel, finger_length_mm: float
) -> Iterator[tuple[int, Forbidden, float]]:
    """Each finger that would touch a region, and how far (mm) it reaches over it: from its tip or from a side, the lesser."""
    if grasp.grip == SURFACE:
        yield from forbidden_faces(grasp, regions, hand, finger_length_mm)
        return
    gripping = gripping_surface(hand, grasp.grip)
    y_low, y_high = gripping.y_range
    rooms = gripping.rooms(finger_length_mm, 2.0 * TOUCH_GAP_MM)
    for region, surface in regions:
        for number, X_GF in enumerate(hand.finger_poses(grasp.opening_width_mm), start=1):
            X_CF = grasp.X_CG @ X_GF
            for X_FB, low, high in rooms:
                X_CB = X_CF @ X_FB
                touched = _within(region, transform(X_CB, surface.within(X_CB, low, high)))
                if len(touched):
                    _, y, z = np.moveaxis(transform(inverse(X_CF), touched), -1, 0)
                    yield number, region, float(min(-z.min(), y_high - y.min(), y.max() - y_low))


def _within(region: Forbidden, triangles_C: FloatArray) -> FloatArray:
    """The parts of triangles (m, 3, 3) that belong to the region."""
    if region.box_min_C is None or region.box_max_C is None or not len(triangles_C):
        return triangles_C
    return clip_to_box(triangles_C, region.box_min_C, region.box_max_C)
