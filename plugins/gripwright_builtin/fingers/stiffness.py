"""How far a finger bends under the grip force (Euler–Bernoulli), and the stress in it."""

from dataclasses import dataclass

import numpy as np

from gripwright.domain.shape import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Bending:
    """Displacement of the tip along the grip direction and the largest bending stress."""

    deflection_mm: float
    stress_MPa: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """What counts of a cross-section that bends along x."""

    inertia_mm4: float  # second moment of area about the neutral axis
    fibre_mm: float  # from the neutral axis to the farthest point


def rectangle_section(thickness_mm: float, width_mm: float) -> Section:
    """Of a rectangle, `thickness_mm` along x."""
    return Section(inertia_mm4=width_mm * thickness_mm**3 / 12.0, fibre_mm=thickness_mm / 2.0)


def polygon_section(corners_mm: FloatArray) -> Section:
    """Of a polygon (k, 2), counter-clockwise, by Green's theorem."""
    (x, y), (u, v) = corners_mm.T, np.roll(corners_mm, -1, axis=0).T
    cross = x * v - u * y
    area = float(cross.sum()) / 2.0
    middle = float(((x + u) * cross).sum()) / (6.0 * area)
    about_y = float(((x**2 + x * u + u**2) * cross).sum()) / 12.0
    return Section(inertia_mm4=about_y - area * middle**2, fibre_mm=float(np.abs(x - middle).max()))


def bend(
    force_N: float,
    modulus_MPa: float,
    length_mm: float,
    stem: Section,
    arm_x_mm: FloatArray,
    arm_width_mm: FloatArray,
    arm_thickness_mm: float,
) -> Bending:
    """A force along x on the tip of a straight stem that stands on an arm.

    The arm runs along x from the bolts to the stem; its width is given at the stations `arm_x_mm` (k,). The stem is a
    cantilever; the arm carries the constant moment F·(L + t/2), turns by θ = ∫ M/(E·I) dx and takes the tip with it.
    """
    arm_inertia = arm_width_mm * arm_thickness_mm**3 / 12.0  # (k,)
    lever = length_mm + arm_thickness_mm / 2.0
    moment = force_N * lever
    turn_rad = float(np.trapezoid(moment / (modulus_MPa * arm_inertia), arm_x_mm))
    deflection = force_N * length_mm**3 / (3.0 * modulus_MPa * stem.inertia_mm4) + turn_rad * lever
    stem_stress = force_N * length_mm * stem.fibre_mm / stem.inertia_mm4
    arm_stress = float((moment * arm_thickness_mm / 2.0 / arm_inertia).max())
    return Bending(deflection_mm=deflection, stress_MPa=max(stem_stress, arm_stress))
