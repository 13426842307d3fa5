"""Grasps that are given up because no finger bears the force that they need."""

import dataclasses
from collections.abc import Mapping
from typing import Any

from gripwright.design.reason import held_with
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import FreeGrasp, Grasp, NearestMiss, OperationVerdict, SegmentVerdict
from gripwright.domain.gripper import Gripper
from gripwright.domain.v_tip import tip_words

_TELLING_NMM = 50.0  # a smaller moment is not what the force is needed for


def fingers_kind(of: Grasp | Gripper) -> str:
    """What fingers are barred by: those of another grip, taper or V are made, and bear forces, otherwise."""
    words = tip_words(of.taper_rad, of.vee)
    return f"{of.grip}, {words}" if words else of.grip


def without_barred(verdict: OperationVerdict, barred: Mapping[str, Any]) -> OperationVerdict:
    """The verdict without the grasps that bend fingers at least as much as is barred for their kind: none bear it."""
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
    if free:
        return dataclasses.replace(segment, free=free)
    miss = _too_heavy(segment, min(given_up, key=lambda grasp: grasp.bending_Nmm), barred)
    return dataclasses.replace(segment, free=free, rejection=Rejection(miss.code, miss.sentence), nearest_miss=miss)


def _too_heavy(segment: SegmentVerdict, lightest: FreeGrasp, barred: Mapping[str, Any]) -> NearestMiss:
    """What the grasp that bends fingers least asks for; up to where fingers could be made is not searched for."""
    grasp, force_N, moment_Nmm = lightest.grasp, lightest.hold.required_force_N, lightest.hold.moment_Nmm
    against = f" against a moment of {moment_Nmm / 1000.0:.1f} N·m" if moment_Nmm >= _TELLING_NMM else ""
    return NearestMiss(
        code="not-held",
        quantity="grip force",
        found=None,
        limit=force_N,
        amount=None,
        unit="N",
        sentence=(
            f"{held_with(grasp, segment.segment)} it takes a grip force of {force_N:.0f} N to hold it by friction"
            f"{against}, and no finger was found that bears it: {barred[fingers_kind(grasp)]['detail']}"
        ),
        gripper_type=grasp.gripper_type,
        grip=grasp.grip,
        opening_width_mm=grasp.opening_width_mm,
        grasp=grasp,
        finger_length_mm=float(lightest.finger_length_min_mm.min()),
        palm_radius_mm=float(lightest.envelopes_mm[0]),
        phase="holding",
    )


def _is_barred(free: FreeGrasp, barred: Mapping[str, Any]) -> bool:
    kind = fingers_kind(free.grasp)
    return kind in barred and free.bending_Nmm >= barred[kind]["bending"]
