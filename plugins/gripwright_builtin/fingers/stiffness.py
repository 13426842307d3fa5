"""How far a finger bends under the grip force (Euler–Bernoulli), and the stress in it."""

from dataclasses import dataclass

import numpy as np

from gripwright.domain.shape import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Bending:
    """Displacement of the tip along the grip direction and the largest bending stress."""

    deflection_mm: float
    stress_MPa: float


def bend(
    force_N: float,
    modulus_MPa: float,
    stem_mm: tuple[float, float, float],
    arm_x_mm: FloatArray,
    arm_width_mm: FloatArray,
    arm_thickness_mm: float,
) -> Bending:
    """A force on the tip of a straight stem (length, thickness along x, width along y) that stands on an arm.

    The arm runs along x from the bolts to the stem; its width is given at the stations `arm_x_mm` (k,). The stem is a
    cantilever; the arm carries the constant moment F·(L + t/2), turns by θ = ∫ M/(E·I) dx and takes the tip with it.
    """
    length, thickness, width = stem_mm
    stem_inertia = width * thickness**3 / 12.0
    arm_inertia = arm_width_mm * arm_thickness_mm**3 / 12.0  # (k,)
    lever = length + arm_thickness_mm / 2.0
    moment = force_N * lever
    turn_rad = float(np.trapezoid(moment / (modulus_MPa * arm_inertia), arm_x_mm))
    deflection = force_N * length**3 / (3.0 * modulus_MPa * stem_inertia) + turn_rad * lever
    stem_stress = force_N * length * thickness / 2.0 / stem_inertia
    arm_stress = float((moment * arm_thickness_mm / 2.0 / arm_inertia).max())
    return Bending(deflection_mm=deflection, stress_MPa=max(stem_stress, arm_stress))
