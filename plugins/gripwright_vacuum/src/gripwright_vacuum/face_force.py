"""The force of an actuator whose face is smaller than the largest that it serves."""

from gripwright.domain.gripper import Actuator


def by_area_N(actuator: Actuator, width_mm: float) -> float | None:
    """In proportion to the face's area: the catalogue states the force of the largest face, `opening_max_mm`. None: not known."""
    if actuator.grip_force_N is None or actuator.opening_max_mm is None:
        return None
    return actuator.grip_force_N * (width_mm / actuator.opening_max_mm) ** 2
