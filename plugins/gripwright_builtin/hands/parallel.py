"""The hand of a 2-finger parallel gripper."""

from typing import ClassVar

from gripwright.domain.grasp import EXTERNAL, PARALLEL_2
from gripwright_builtin.hands.prism import PrismHand


class ParallelHand(PrismHand):
    """Two straight fingers at 0° and 180° that move along x together."""

    key: ClassVar[str] = "parallel_2"
    gripper_type: ClassVar[str] = PARALLEL_2
    fingers: ClassVar[int] = 2

    def opening_floor_mm(self, grip: str) -> float:
        """Zero: the gripping surfaces meet. From inside, the fingers' backs meet at twice their thickness."""
        return 0.0 if grip == EXTERNAL else 2.0 * self._params.thickness_mm
