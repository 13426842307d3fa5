"""The hand of a 3-finger centric gripper."""

import math
from typing import ClassVar

from gripwright.domain.grasp import CENTRIC_3, EXTERNAL
from gripwright_builtin.hands.prism import PrismHand


class CentricHand(PrismHand):
    """Three straight fingers at 0°, 120° and 240° that move radially together."""

    key: ClassVar[str] = "centric_3"
    gripper_type: ClassVar[str] = CENTRIC_3
    fingers: ClassVar[int] = 3

    def opening_floor_mm(self, grip: str) -> float:
        """Neighbouring fingers of width w meet at their inner edges when r = w/(2·√3) (external grip).

        From inside, the fingers' backs meet first: r = t + w/(2·√3).
        """
        meeting = self._params.width_mm / (2.0 * math.sqrt(3.0))
        return 2.0 * (meeting if grip == EXTERNAL else meeting + self._params.thickness_mm)
