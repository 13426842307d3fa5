"""Straight fingers with concave tips: a three-finger gripper that holds cylinders from outside touches them over more width."""

from collections.abc import Sequence
from typing import ClassVar

from pydantic import Field

from gripwright.domain.groove import Groove
from gripwright_builtin.fingers.straight import StraightFinger, StraightFingerParams


class ConcaveFingerParams(StraightFingerParams):
    """Measures and material, as of a straight finger, and when a groove is cut."""

    play: float = Field(0.01, ge=0, le=0.05, description="mm, of the groove's radius over that of the largest component")
    depth_min: float = Field(0.1, gt=0, le=5, description="mm, a shallower groove is not cut")
    depth_max: float = Field(4.0, gt=0, le=20, description="mm, nor a deeper one")


class ConcaveFinger(StraightFinger):
    """A straight finger whose tip is hollow with the radius of the largest cylinder that the gripper holds.

    Smaller cylinders touch at the groove's bottom. Where a gripper holds anything else, or has two fingers, tips stay flat.
    """

    key: ClassVar[str] = "concave"
    params_model: ClassVar[type[StraightFingerParams]] = ConcaveFingerParams

    def __init__(self, params: ConcaveFingerParams) -> None:
        super().__init__(params)
        self._play_mm, self._depth_min_mm, self._depth_max_mm = params.play, params.depth_min, params.depth_max

    def groove(self, contact_radii_mm: Sequence[float], width_mm: float) -> Groove | None:
        """About the largest cylinder, if that makes neither a scratch nor a claw."""
        radius = max(contact_radii_mm) + self._play_mm
        if radius <= width_mm / 2.0:
            return None
        groove = Groove(radius_mm=radius, width_mm=width_mm)
        return groove if self._depth_min_mm <= groove.depth_mm <= self._depth_max_mm else None
