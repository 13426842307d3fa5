"""Grasps that are given up because no finger bears the force that they need."""

import dataclasses
from collections.abc import Mapping
from typing import Any

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import OperationVerdict, SegmentVerdict


def without_barred(verdict: OperationVerdict, barred: Mapping[str, Any] | None) -> OperationVerdict:
    """The verdict without the grasps that need at least the barred force: no finger bears it."""
    if barred is None:
        return verdict
    return dataclasses.replace(
        verdict,
        components={
            name: tuple(_lighter(segment, barred["force"], barred["detail"]) for segment in segments)
            for name, segments in verdict.components.items()
        },
    )


def _lighter(segment: SegmentVerdict, force_N: float, detail: str) -> SegmentVerdict:
    free = tuple(grasp for grasp in segment.free if grasp.hold.required_force_N < force_N)
    if len(free) == len(segment.free):
        return segment
    return dataclasses.replace(segment, free=free, rejection=None if free else Rejection("not-held", detail))
