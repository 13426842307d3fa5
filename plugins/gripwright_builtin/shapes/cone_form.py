"""Endless cones: proposed from three facets, moved by least squares. Cylinders are those of slope 0."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from gripwright.domain.shape import FloatArray
from gripwright.geometry.frames import any_perpendicular
from gripwright_builtin.shapes.patches import FlatPatches

_DRAWS = 120
_TURNED = 0.01  # least length of the cross product that tells an axis
_FLAT = 0.2  # least part of a normal across the axis
_RADII = (1e-3, 5.0)
_TILT = 0.2  # by so much a normal's part along the axis may be another
_ON_AXIS = 1e-3  # a corner so near to the axis is the apex, which has no normal


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ConeForm:
    """Radius at `point`, which lies on the axis, and how much it grows by the length along the axis."""

    point: FloatArray  # (3,)
    axis: FloatArray  # (3,) unit
    radius: float
    slope: float

    @property
    def free(self) -> int:
        """Two tilts, two shifts, radius and slope."""
        return 6

    @property
    def narrowing(self) -> "ConeForm":
        """The same with an axis along which it narrows."""
        if self.slope <= 0.0:
            return self
        return ConeForm(point=self.point, axis=-self.axis, radius=self.radius, slope=-self.slope)

    def distances(self, points: FloatArray) -> FloatArray:
        """See `Form`."""
        along, radial = self._seen(points)
        off = np.linalg.norm(radial, axis=1) - self.radius - self.slope * along
        return np.asarray(off / np.hypot(1.0, self.slope))

    def cosines(self, points: FloatArray, facing: FloatArray) -> FloatArray:
        """See `Form`: of the angle about the axis, 0 where the tilt along it is another."""
        _, radial = self._seen(points)
        distance = np.linalg.norm(radial, axis=1)
        tilt = facing @ self.axis  # (n,)
        across = np.sqrt(np.maximum(1.0 - tilt**2, 1e-12))
        cosine = (facing * radial).sum(axis=1) / np.maximum(distance * across, 1e-12)
        expected = -np.sign(cosine) * self.slope / np.hypot(1.0, self.slope)
        known = np.where(np.abs(tilt - expected) <= _TILT, cosine, 0.0)
        return np.where(distance > _ON_AXIS, known, np.nan)

    def moved(self, step: FloatArray) -> Self:
        """See `Form`."""
        x = any_perpendicular(self.axis)
        y = np.cross(self.axis, x)
        axis = self.axis + step[0] * x + step[1] * y
        return type(self)(
            point=self.point + step[2] * x + step[3] * y,
            axis=axis / np.linalg.norm(axis),
            radius=self.radius + float(step[4]),
            slope=self.slope + float(step[5]),
        )

    def _seen(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Along the axis (n,), and across it (n, 3)."""
        v = points - self.point
        along = v @ self.axis
        return along, v - along[:, None] * self.axis


def cone_forms(patches: FlatPatches, rng: np.random.Generator) -> list[ConeForm]:
    """Cones that three patches each touch with their middles, as they face."""
    if len(patches.areas) < 3:
        return []
    drawn = patches.drawn(rng, _DRAWS, 3)
    n, c = patches.normals[drawn], patches.centres[drawn]  # (d, 3, 3)
    axes = np.cross(n[:, 0] - n[:, 1], n[:, 0] - n[:, 2])
    length = np.linalg.norm(axes, axis=1)
    axes = axes / np.maximum(length, 1e-300)[:, None]
    across = n - np.einsum("dij,dj->di", n, axes)[..., None] * axes[:, None]
    wide = np.linalg.norm(across, axis=2)  # (d, 3)
    firm = (length > _TURNED) & (wide > _FLAT).all(axis=1)
    tilt = np.einsum("dij,dj->di", n, axes).mean(axis=1)
    return _touching(c[firm], axes[firm], (across / np.maximum(wide, 1e-12)[..., None])[firm], tilt[firm])


def _touching(c: FloatArray, axes: FloatArray, u: FloatArray, tilt: FloatArray) -> list[ConeForm]:
    """From points c (d, 3, 3), the directions u (d, 3, 3) across the axes (d, 3) in which they face, and their tilt (d,).

    A point's place across the axis is that of the axis plus (r + k z) u: linear in the place and r, and the tilt tells k.
    """
    x = np.array([any_perpendicular(axis) for axis in axes]).reshape(-1, 3)
    plane = np.stack([x, np.cross(axes, x)], axis=1)  # (d, 2, 3)
    along = np.einsum("dij,dj->di", c, axes)  # (d, 3)
    slope = -tilt / np.sqrt(np.maximum(1.0 - tilt**2, 1e-12))
    facing = np.einsum("dij,dkj->dik", u, plane)  # (d, 3, 2)
    left = np.zeros((len(axes), 3, 2, 3))
    left[:, :, 0, 0] = left[:, :, 1, 1] = 1.0
    left[..., 2] = facing
    right = np.einsum("dij,dkj->dik", c, plane) - (slope[:, None] * along)[..., None] * facing
    solved = (np.linalg.pinv(left.reshape(-1, 6, 3)) @ right.reshape(-1, 6, 1))[..., 0]  # (d, 3)
    radius = solved[:, 2] + slope * along.mean(axis=1)
    good = (np.abs(radius) > _RADII[0]) & (np.abs(radius) < _RADII[1])
    return [
        ConeForm(
            point=solved[k, :2] @ plane[k],
            axis=axes[k],
            radius=float(solved[k, 2] * np.sign(radius[k])),
            slope=float(slope[k] * np.sign(radius[k])),
        )
        for k in np.flatnonzero(good)
    ]
