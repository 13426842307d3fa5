"""What a labelling costs: the energy that alpha expansion lowers, as published and independent of the tessellation."""

from dataclasses import dataclass

import numpy as np

from gripwright.domain.shape import FloatArray

SMOOTHNESS_SCALE = 100.0
"""Weight of a border for smoothness 1, as in CGAL."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Energy:
    """Costs of labels and borders."""

    data: FloatArray  # (m, k) of each label on each face
    borders: FloatArray  # (e,) of different labels on the two faces of each pair


PUBLISHED_PROBABILITY_MIN = 5e-6
PUBLISHED_CONVEX_FACTOR = 0.08
"""A convex edge counts as this part of its angle: people cut along concave creases (the minima rule)."""


def published_energy(probabilities: FloatArray, exterior_angles_rad: FloatArray, smoothness: float) -> Energy:
    """Each face and each edge count alike, whatever their size (Shapira et al., 2008; constants as in CGAL)."""
    share = np.abs(exterior_angles_rad) / np.pi * np.where(exterior_angles_rad > 0, PUBLISHED_CONVEX_FACTOR, 1.0)
    turn = -np.log(np.clip(share, PUBLISHED_PROBABILITY_MIN, 1.0 - PUBLISHED_PROBABILITY_MIN))
    return Energy(
        data=-np.log(np.maximum(probabilities, PUBLISHED_PROBABILITY_MIN)), borders=SMOOTHNESS_SCALE * smoothness * turn
    )


PROBABILITY_MIN = 0.02
"""No face of whatever thickness is more certain than this: the ends of a cylinder differ from the rest of it."""
SMOOTH_BORDER = 36.6
"""Cost of a border across smooth surface: three times that published (−log of the smallest angle), since on a mesh a border
zigzags, and since an engineer does not divide a cylinder where a bore in it ends."""
CONCAVE_SHARE, CONVEX_SHARE = 0.005, 0.13
"""Parts of it that a border along a sharp concave and a sharp convex edge costs."""
SMOOTH_RAD, SHARP_RAD = np.radians(20.0), np.radians(60.0)
"""Edges below the first are facets of a smooth surface, whatever their number; edges above the second are sharp."""
BEND_SMOOTH_RAD, BEND_SHARP_RAD = np.radians(20.0), np.radians(75.0)
BEND_COST = 0.01
"""The same for bends, which extend over some width: they cost a little more, so that an edge in their middle is preferred."""
REFERENCE_FACES = 30_000
"""Even mesh on which areas and lengths weigh as much as the published energy's faces and edges."""


def area_energy(
    probabilities: FloatArray, areas_mm2: FloatArray, shares: FloatArray, lengths_mm: FloatArray, smoothness: float
) -> Energy:
    """Faces count by area, borders by length: dividing faces changes nothing. `shares` as of `border_shares`."""
    face = areas_mm2.sum() / REFERENCE_FACES
    edge = np.sqrt(4.0 * face / np.sqrt(3.0))  # side of an equilateral triangle of that area
    return Energy(
        data=-np.log(np.maximum(probabilities, PROBABILITY_MIN)) * (areas_mm2 / face)[:, None],
        borders=SMOOTHNESS_SCALE * smoothness * SMOOTH_BORDER * shares * lengths_mm / edge,
    )


def border_shares(exterior_angles_rad: FloatArray, bends_rad: FloatArray) -> FloatArray:
    """Cost of a border for its length, (e,): 1 on smooth surface, less along convex edges, hardly any in concave creases.

    A crease is an edge, or a bend of the surface over several edges, at a somewhat higher cost.
    """
    edge = _shares(exterior_angles_rad, SMOOTH_RAD, SHARP_RAD)
    return np.minimum(edge, BEND_COST + (1.0 - BEND_COST) * _shares(bends_rad, BEND_SMOOTH_RAD, BEND_SHARP_RAD))


def _shares(angles_rad: FloatArray, smooth_rad: float, sharp_rad: float) -> FloatArray:
    step = np.clip((np.abs(angles_rad) - smooth_rad) / (sharp_rad - smooth_rad), 0.0, 1.0)
    step = step * step * (3.0 - 2.0 * step)
    return np.asarray(1.0 - step * (1.0 - np.where(angles_rad > 0, CONVEX_SHARE, CONCAVE_SHARE)))
