"""The hand of a 3-finger centric gripper."""

import math
from collections.abc import Sequence
from typing import ClassVar

from gripwright.domain.grasp import CENTRIC_3, EXTERNAL
from gripwright.domain.gripper import ConvexSolid
from gripwright.domain.shape import FloatArray
from gripwright.plugin_api.params import Params
from gripwright_builtin.hands.prism import HandSettings, finger_poses, round_palm, straight_finger


class CentricHand:
    """Three straight fingers at 0°, 120° and 240° that move radially together."""

    key: ClassVar[str] = "centric_3"
    params_model: ClassVar[type[Params]] = HandSettings
    gripper_type: ClassVar[str] = CENTRIC_3
    fingers: ClassVar[int] = 3

    def __init__(self, params: HandSettings) -> None:
        self._params = params

    def finger_poses(self, opening_width_mm: float) -> FloatArray:
        """X_GF, (3, 4, 4)."""
        return finger_poses(self.fingers, opening_width_mm)

    def finger(self, finger_length_mm: float, grip: str) -> Sequence[ConvexSolid]:
        """One box, frame F."""
        return straight_finger(self._params, finger_length_mm, grip)

    def palm(self, finger_length_mm: float, envelope_mm: float, depth_mm: float) -> Sequence[ConvexSolid]:
        """A round palm, frame G."""
        return round_palm(finger_length_mm, envelope_mm, depth_mm)

    def opening_floor_mm(self, grip: str) -> float:
        """Neighbouring fingers of width w meet at their inner edges when r = w/(2·√3) (external grip).

        From inside, the fingers' backs meet first: r = t + w/(2·√3).
        """
        meeting = self._params.width_mm / (2.0 * math.sqrt(3.0))
        return 2.0 * (meeting if grip == EXTERNAL else meeting + self._params.thickness_mm)
