"""How far the pads of a gripper are pressed in by the least force that holds."""

import math
from collections.abc import Iterator, Sequence

from gripwright.design.stages.fingers import GripperCad
from gripwright.domain.errors import Rejection
from gripwright.domain.gripper import Gripper, Handle


def pad_compression(handle: Handle, cad: GripperCad) -> float | None:
    """The share of its thickness by which the required grip force presses a pad, on average over its contact; None: no pad."""
    bonded = cad.finger.bonded
    if bonded is None or bonded.bought is not None or handle.hold.contact_area_mm2 <= 0.0:
        return None
    pad = cad.spec.pad
    vee = handle.grasp.vee
    wedged = 1.0 if vee is None else math.cos(vee.turn_rad)  # flanks of a V are pressed more than the fingers close
    pressure_MPa = handle.hold.required_force_N / wedged / handle.hold.contact_area_mm2  # of all fingers together
    return pressure_MPa / pad.normal_N_mm3 / pad.thickness_mm


def pad_warnings(grippers: Sequence[Gripper], cads: Sequence[GripperCad | Rejection | None]) -> Iterator[str]:
    """Handles that press their pads farther than rubber bears for long."""
    for gripper, cad in zip(grippers, cads, strict=True):
        if not isinstance(cad, GripperCad):
            continue
        for handle in gripper.handles:
            share, pad = pad_compression(handle, cad), cad.spec.pad
            if share is not None and share > pad.compression:
                yield (
                    f"{gripper.id}, {handle.operation}: holding {handle.component} presses pads by {100 * share:.0f} % of their "
                    f"thickness; {pad.material} bears {100 * pad.compression:.0f} % for long: expect to renew them"
                )
