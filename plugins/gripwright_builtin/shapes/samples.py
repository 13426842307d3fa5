"""Samples for the conformance checks, which have none of these shapes: components for fitters, primitives for rules. In mm."""

from collections.abc import Sequence

import numpy as np

from gripwright.domain.shape import Cylinder, Primitive
from gripwright.testing import Sample
from gripwright_builtin.shapes.cone import Cone
from gripwright_builtin.shapes.extrusion import Extrusion
from gripwright_builtin.shapes.prism import Prism
from gripwright_builtin.shapes.pyramid import Pyramid
from gripwright_builtin.shapes.sphere import Sphere
from gripwright_builtin.shapes.torus import Torus

_X, _Z = np.eye(3)[0], np.eye(3)[2]


def cones() -> Sequence[Primitive]:
    """One for tapered tips, and one so slender that straight fingers touch it."""
    return [_cone(10.0, 4.0), _cone(10.0, 9.9)]


def _cone(radius_mm: float, radius_top_mm: float) -> Cone:
    return Cone(
        center_C=np.zeros(3),
        axis_C=_Z,
        radius_mm=radius_mm,
        radius_top_mm=radius_top_mm,
        height_mm=15.0,
        internal=False,
        arc_rad=2.0 * np.pi,
        ends_filled=np.ones(2),
        rms_mm=0.0,
        surface_filled=True,
    )


def pins() -> Sequence[Primitive]:
    """A cylinder as V tips hold it."""
    return [
        Cylinder(
            center_C=np.zeros(3),
            axis_C=_Z,
            radius_mm=7.0,
            height_mm=26.0,
            internal=False,
            arc_rad=2.0 * np.pi,
            rms_mm=0.0,
            surface_filled=True,
        )
    ]


def pyramids() -> Sequence[Sample | Primitive]:
    """Frusta of four sides and of six for tapered tips, and one so slender that straight fingers lie on it."""
    frustum = _pyramid(20.0, 12.0)
    sample = Sample.of("pyramid", frustum.drawn())
    return [sample, sample.tilted(), frustum, _pyramid(20.0, 12.0, sides=6), _pyramid(20.0, 19.9)]


def _pyramid(across_mm: float, across_top_mm: float, sides: int = 4) -> Pyramid:
    return Pyramid(
        sides=sides,
        center_C=np.zeros(3),
        axis_C=_Z,
        side_C=_X,
        across_flats_mm=across_mm,
        across_flats_top_mm=across_top_mm,
        height_mm=15.0,
        internal=False,
        filled=np.ones(sides),
        ends_filled=np.ones(2),
        filled_min=0.6,
        rms_mm=0.0,
    )


def spheres() -> Sequence[Primitive]:
    """One so large that straight fingers touch it."""
    return [
        Sphere(
            center_C=np.zeros(3),
            radius_mm=40.0,
            axis_C=_Z,
            low_mm=-40.0,
            high_mm=40.0,
            internal=False,
            rms_mm=0.0,
            surface_filled=True,
        )
    ]


def tori() -> Sequence[Sample | Primitive]:
    """A whole one, upright and tilted, with a tube so thick that straight fingers touch it."""
    torus = Torus(
        center_C=np.zeros(3),
        axis_C=_Z,
        start_C=_X,
        arc_rad=2.0 * np.pi,
        major_radius_mm=80.0,
        minor_radius_mm=27.0,
        internal=False,
        rms_mm=0.0,
        surface_filled=True,
    )
    sample = Sample.of("torus", torus.drawn())
    return [sample, sample.tilted(), torus]


def profiles() -> Sequence[Primitive]:
    """A hexagonal prism, and an angle."""
    prism = Prism(
        sides=6,
        center_C=np.zeros(3),
        axis_C=_Z,
        side_C=_X,
        across_flats_mm=20.0,
        height_mm=14.0,
        internal=False,
        filled=np.ones(6),
        ends_filled=np.ones(2),
        filled_min=0.6,
        rms_mm=0.0,
    )
    angle = Extrusion(
        X_CB=np.eye(4),
        outline_B=np.array([[0.0, 0.0], [30.0, 0.0], [30.0, 6.0], [6.0, 6.0], [6.0, 20.0], [0.0, 20.0]]),
        height_mm=14.0,
        internal=False,
        ends_filled=np.ones(2),
        rms_mm=0.0,
        surface_filled=True,
    )
    return [prism, angle]
