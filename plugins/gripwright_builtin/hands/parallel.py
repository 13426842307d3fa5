"""The hand of a 2-finger parallel gripper."""

from collections.abc import Sequence
from typing import ClassVar

from gripwright.domain.grasp import EXTERNAL, PARALLEL_2
from gripwright.domain.gripper import ConvexSolid
from gripwright.domain.shape import FloatArray
from gripwright.plugin_api.params import Params
from gripwright_builtin.hands.prism import HandSettings, finger_poses, round_palm, straight_finger


class ParallelHand:
    """Two straight fingers at 0° and 180° that move along x together."""

    key: ClassVar[str] = "parallel_2"
    params_model: ClassVar[type[Params]] = HandSettings
    gripper_type: ClassVar[str] = PARALLEL_2
    fingers: ClassVar[int] = 2

    def __init__(self, params: HandSettings) -> None:
        self._params = params

    def finger_poses(self, opening_width_mm: float) -> FloatArray:
        """X_GF, (2, 4, 4)."""
        return finger_poses(self.fingers, opening_width_mm)

    def finger(self, finger_length_mm: float, grip: str) -> Sequence[ConvexSolid]:
        """One box, frame F."""
        return straight_finger(self._params, finger_length_mm, grip)

    def palm(self, finger_length_mm: float, envelope_mm: float, depth_mm: float) -> Sequence[ConvexSolid]:
        """A round palm, frame G."""
        return round_palm(finger_length_mm, envelope_mm, depth_mm)

    def opening_floor_mm(self, grip: str) -> float:
        """Zero: the gripping surfaces meet. From inside, the fingers' backs meet at twice their thickness."""
        return 0.0 if grip == EXTERNAL else 2.0 * self._params.thickness_mm
