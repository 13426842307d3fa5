"""Convex solids that shrink along a line, and where they pass.

A hand's palm moves back as its fingers grow, and a stem ends sooner as they shrink: some faces of a convex solid move inwards
with a length s, the others stay. `TriangleBlocks` tells the last s at which such a solid touches a mesh.
"""

from dataclasses import dataclass

import numpy as np

from gripwright.domain.shape import FloatArray
from gripwright.geometry.polytope import Faces

_STEEP = 1e-9  # faces along the line to within this stay


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Passage:
    """Places of a solid's frame, (k, 4, 4): one where it stands, or the two ends of an arc of less than a half turn."""

    places: FloatArray
    axis: FloatArray | None = None  # (2, 3) point and direction of the screw motion between two places
    arc_rad: float = 0.0

    @property
    def bulge(self) -> float:
        """By how much the arc leaves its chord, as a share of the radius."""
        return float(1.0 - np.cos(self.arc_rad / 2.0))

    def box(self, centre: FloatArray, half: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Low and high corner of the box around a box of the solid's frame at every place, and on the arc between."""
        middles = self.places[:, :3, :3] @ centre + self.places[:, :3, 3]  # (k, 3)
        halves = np.abs(self.places[:, :3, :3]) @ half
        if self.axis is not None:
            arms = np.linalg.norm(np.cross(middles - self.axis[0], self.axis[1]), axis=1)
            halves = halves + self.bulge * (arms.max() + np.linalg.norm(half))
        return (middles - halves).min(axis=0), (middles + halves).max(axis=0)


def standing(X: FloatArray) -> Passage:
    """A solid at one place."""
    return Passage(places=X[None])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shrinking:
    """A convex solid that shrinks as s (mm) grows: normal · p ≤ offset − rate · s, with no rate below 0."""

    normals: FloatArray  # (f, 3)
    offsets: FloatArray  # (f,)
    rates: FloatArray  # (f,)
    centre: FloatArray  # (3,) of a box that holds it for every s that is asked about
    half: FloatArray  # (3,)


def withdrawn(faces: Faces, direction: FloatArray, length_mm: float, start_mm: float = 0.0) -> Shrinking:
    """A solid that moves along a unit direction by s from `start_mm` to `length_mm`; its back stays where it ends up."""
    rates = -faces.normals @ direction
    ends = np.stack([direction * start_mm, direction * length_mm])
    low, high = faces.low + ends.min(axis=0), faces.high + ends.max(axis=0)
    return _shrinking(faces, rates, faces.offsets + length_mm * np.maximum(-rates, 0.0), low, high)


def shortened(faces: Faces, direction: FloatArray) -> Shrinking:
    """A solid whose end that looks along a unit direction moves against it by s."""
    return _shrinking(faces, faces.normals @ direction, faces.offsets, faces.low, faces.high)


def unchanging(faces: Faces) -> Shrinking:
    """A solid that stays as it is."""
    return _shrinking(faces, np.zeros(len(faces.offsets)), faces.offsets, faces.low, faces.high)


def _shrinking(faces: Faces, rates: FloatArray, offsets: FloatArray, low: FloatArray, high: FloatArray) -> Shrinking:
    moving_first = np.argsort(-rates, kind="stable")
    return Shrinking(
        normals=np.ascontiguousarray(faces.normals[moving_first]),
        offsets=offsets[moving_first],
        rates=np.where(rates > _STEEP, rates, 0.0)[moving_first],
        centre=(low + high) / 2.0,
        half=(high - low) / 2.0,
    )
