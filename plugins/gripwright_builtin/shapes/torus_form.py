"""Endless tori: proposed from two facets about a likely axis, moved by least squares."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from gripwright.domain.shape import FloatArray
from gripwright.geometry.frames import any_perpendicular
from gripwright_builtin.shapes.patches import FlatPatches

_DRAWS = 30  # an axis
_PLANES = 3  # the largest, whose normals are tried as an axis
_SAME = 0.999  # cosine between axes of which one is enough
_ACROSS = 0.15  # least part of a normal across the axis
_MINOR, _MAJOR = (1e-3, 1.0), (1e-3, 5.0)  # shares of the size; longer ones bend hardly


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TorusForm:
    """A tube of radius `minor` around the circle of radius `major` about the axis through `point`."""

    point: FloatArray  # (3,) centre of the circle
    axis: FloatArray  # (3,) unit
    major: float
    minor: float

    @property
    def free(self) -> int:
        """Two tilts, three shifts and both radii."""
        return 7

    def distances(self, points: FloatArray) -> FloatArray:
        """See `Form`."""
        return np.asarray(np.linalg.norm(self.from_circle(points), axis=1) - self.minor)

    def cosines(self, points: FloatArray, facing: FloatArray) -> FloatArray:
        """See `Form`."""
        away = self.from_circle(points)
        return np.asarray((away * facing).sum(axis=1) / np.maximum(np.linalg.norm(away, axis=1), 1e-12))

    def moved(self, step: FloatArray) -> Self:
        """See `Form`."""
        x = any_perpendicular(self.axis)
        y = np.cross(self.axis, x)
        axis = self.axis + step[0] * x + step[1] * y
        return type(self)(
            point=self.point + step[2] * x + step[3] * y + step[4] * self.axis,
            axis=axis / np.linalg.norm(axis),
            major=self.major + float(step[5]),
            minor=self.minor + float(step[6]),
        )

    def from_circle(self, points: FloatArray) -> FloatArray:
        """Vectors from the nearest place of the circle, (n, 3)."""
        v = points - self.point
        along = v @ self.axis
        across = v - along[:, None] * self.axis
        return np.asarray(v - across * (self.major / np.maximum(np.linalg.norm(across, axis=1), 1e-12))[:, None])


def torus_forms(patches: FlatPatches, rng: np.random.Generator) -> list[TorusForm]:
    """Tori about each likely axis that two patches each touch with their middles, as they face."""
    if len(patches.areas) < 2:
        return []
    return [form for axis in _axes(patches) for form in _about(axis, patches, rng)]


def _axes(patches: FlatPatches) -> list[FloatArray]:
    """Principal axes of the surface and of its normals, one of which a torus's axis is by symmetry; normals of large planes."""
    share = patches.areas / patches.areas.sum()
    centred = patches.centres - share @ patches.centres
    spread = np.linalg.eigh((centred * share[:, None]).T @ centred)[1].T
    facing = np.linalg.eigh((patches.normals * share[:, None]).T @ patches.normals)[1].T
    planes = patches.normals[np.argsort(-patches.areas, kind="stable")[:_PLANES]]
    axes: list[FloatArray] = []
    for axis in np.concatenate([spread, facing, planes]):
        if all(abs(axis @ other) < _SAME for other in axes):
            axes.append(axis)
    return axes


def _about(axis: FloatArray, patches: FlatPatches, rng: np.random.Generator) -> list[TorusForm]:
    """The normals of both patches meet the axis, seen along it; then both lie on one circle, seen across it."""
    x = any_perpendicular(axis)
    plane = np.stack([x, np.cross(axis, x)])  # (2, 3)
    drawn = patches.drawn(rng, _DRAWS, 2)
    c, n = patches.centres[drawn], patches.normals[drawn]  # (d, 2, 3)
    place, towards = c @ plane.T, n @ plane.T  # (d, 2, 2)
    cross = towards[:, 0, 0] * towards[:, 1, 1] - towards[:, 0, 1] * towards[:, 1, 0]
    step = place[:, 1] - place[:, 0]
    firm = (np.abs(cross) > 0.02) & (np.linalg.norm(towards, axis=2) > _ACROSS).all(axis=1)
    far = np.divide(step[:, 0] * towards[:, 1, 1] - step[:, 1] * towards[:, 1, 0], cross, out=np.zeros(len(c)), where=firm)
    centre = place[:, 0] + far[:, None] * towards[:, 0]  # (d, 2) where the axis is
    out = place - centre[:, None]
    distance = np.linalg.norm(out, axis=2)  # (d, 2)
    seen = np.stack([distance, c @ axis], axis=2)  # (d, 2, 2) in the half plane of radius and height
    facing = np.stack([(towards * out).sum(axis=2) / np.maximum(distance, 1e-12), n @ axis], axis=2)
    turn = facing[:, 0] - facing[:, 1]
    square = (turn**2).sum(axis=1)
    minor = np.divide(((seen[:, 0] - seen[:, 1]) * turn).sum(axis=1), square, out=np.zeros(len(c)), where=square > 1e-3)
    circle = (seen - minor[:, None, None] * facing).mean(axis=1)  # (d, 2) radius and height of the tube's middle
    good = firm & (np.abs(minor) > _MINOR[0]) & (np.abs(minor) < _MINOR[1])
    good &= (circle[:, 0] > _MAJOR[0]) & (circle[:, 0] < _MAJOR[1])
    return [
        TorusForm(point=centre[k] @ plane + circle[k, 1] * axis, axis=axis, major=float(circle[k, 0]), minor=float(abs(minor[k])))
        for k in np.flatnonzero(good)
    ]
