"""Forbidden surface before the face of a hand that does not close: a suction cup, a magnet. Lengths in mm."""

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.spatial import ConvexHull

from gripwright.domain.affordance import Forbidden
from gripwright.domain.grasp import SURFACE, Grasp
from gripwright.domain.shape import FloatArray
from gripwright.geometry.clipping import clip_to_box, corners_within
from gripwright.geometry.frames import inverse, transform
from gripwright.geometry.held_surface import TOUCH_GAP_MM, Surface
from gripwright.plugin_api import HandModel

_FRONT_MM = 1e-6


def forbidden_faces(
    grasp: Grasp, regions: Sequence[tuple[Forbidden, Surface]], hand: HandModel, finger_length_mm: float
) -> Iterator[tuple[int, Forbidden, float]]:
    """Each face (from 1 on) that would touch a region, and how far (mm) it reaches over it from its rim."""
    normals, offsets = _front(hand, finger_length_mm)
    low, high = np.full(3, -np.inf), np.full(3, np.inf)
    low[2], high[2] = -2.0 * TOUCH_GAP_MM, 2.0 * TOUCH_GAP_MM
    for region, surface in regions:
        for number, X_GF in enumerate(hand.finger_poses(grasp.opening_width_mm), start=1):
            X_CF = grasp.X_CG @ X_GF
            before = surface.within(X_CF, low, high)
            if region.box_min_C is not None and region.box_max_C is not None and len(before):
                inside = clip_to_box(transform(X_CF, before), region.box_min_C, region.box_max_C)
                before = transform(inverse(X_CF), inside)
            corners = corners_within(before, normals, offsets) if len(before) else np.empty((0, 3))
            if len(corners):
                yield number, region, float((offsets - corners @ normals.T).min(axis=1).max())


def _front(hand: HandModel, finger_length_mm: float) -> tuple[FloatArray, FloatArray]:
    """The outline of the face that lies in z = 0: normal · p ≤ offset for each side, in frame F."""
    vertices = np.concatenate([solid.vertices_mm for solid in hand.finger(finger_length_mm, SURFACE)])
    sides = ConvexHull(vertices[vertices[:, 2] > -_FRONT_MM][:, :2]).equations  # (f, 3)
    return np.column_stack([sides[:, :2], np.zeros(len(sides))]), -sides[:, 2]
