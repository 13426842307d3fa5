"""Grasps that are given up because no finger bears the force that they need."""

import dataclasses
from collections.abc import Mapping
from typing import Any

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import FreeGrasp, OperationVerdict, SegmentVerdict


def without_barred(verdict: OperationVerdict, barred: Mapping[str, Any]) -> OperationVerdict:
    """The verdict without the grasps that need at least the force barred for their grip: no finger bears it."""
    if not barred:
        return verdict
    return dataclasses.replace(
        verdict,
        components={
            name: tuple(_lighter(segment, barred) for segment in segments) for name, segments in verdict.components.items()
        },
    )


def _lighter(segment: SegmentVerdict, barred: Mapping[str, Any]) -> SegmentVerdict:
    given_up = [free for free in segment.free if _is_barred(free, barred)]
    if not given_up:
        return segment
    free = tuple(grasp for grasp in segment.free if not _is_barred(grasp, barred))
    detail = barred[given_up[0].grasp.grip]["detail"]
    return dataclasses.replace(segment, free=free, rejection=None if free else Rejection("not-held", detail))


def _is_barred(free: FreeGrasp, barred: Mapping[str, Any]) -> bool:
    grip = free.grasp.grip
    return grip in barred and free.hold.required_force_N >= barred[grip]["force"]
