"""What holding a component asks of the gripper: friction against gravity, acceleration and insertion force (paper, 5.4)."""

import numpy as np

from gripwright.domain.grasp import Grasp, Hold
from gripwright.domain.shape import FloatArray

GRAVITY_M_S2 = 9.81
ACCELERATION_M_S2 = 5.0  # of the robot while it carries, any direction


def hold(
    grasp: Grasp,
    contact_centres_C: FloatArray,
    contact_areas_mm2: FloatArray,
    centroid_C: FloatArray,
    mass_kg: float,
    friction: float,
    force_N: float,
) -> Hold:
    """Total grip force that Coulomb friction needs for the load in any direction, and the load's moment about the contacts.

    The load is m·(g + a), in the worst direction, plus the insertion force. The total grip force F presses the fingers with
    F/n each, and their friction carries μ·F together.
    """
    load_N = mass_kg * (GRAVITY_M_S2 + ACCELERATION_M_S2) + force_N
    middle = contact_centres_C.mean(axis=0)
    arm_mm = float(np.linalg.norm(centroid_C - middle))
    across = centroid_C - grasp.X_CG[:3, 3]
    off_axis = float(np.linalg.norm(across - grasp.X_CG[:3, 2] * (across @ grasp.X_CG[:3, 2])))
    span = float(np.linalg.norm(contact_centres_C - middle, axis=1).max())
    return Hold(
        required_force_N=load_N / friction if friction > 0 else float("inf"),
        moment_Nmm=mass_kg * (GRAVITY_M_S2 + ACCELERATION_M_S2) * arm_mm,
        symmetry=span / (span + off_axis) if span + off_axis > 0 else 1.0,
        contact_area_mm2=float(contact_areas_mm2.sum()),
    )
