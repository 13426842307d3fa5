"""What a grasp has to hold, and where it touches. Component frame C, lengths in mm."""

from dataclasses import dataclass

from gripwright.domain.shape import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Contact:
    """The contact of one finger: height along the gripper's z (of a face its diameter), area and centre of what touches.

    A finger with a V has two, one a flank.
    """

    height_mm: float
    area_mm2: float
    centre_C: FloatArray  # (3,)
    normal_C: FloatArray  # (3,) outward normal of the component there
    gap_mm: float
    closing_C: FloatArray | None = None  # (3,) the way its finger closes; None: against the normal, but for its part along z
    room_mm: float = float("inf")  # how wide the strip that touches may become


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Load:
    """What an operation asks of a grasp, seen from the held component. It is the same for all its grasps."""

    mass_kg: float  # of everything that moves
    force_N: float  # insertion force
    centroid_C: FloatArray  # (3,) of everything that moves
    gravity_C: FloatArray  # (g, 3) unit directions that the weight takes along the motion, the last at its end
    insertion_C: FloatArray  # (2, 3) where the insertion force acts, and the unit direction of the motion there, at its end
