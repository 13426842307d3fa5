"""Grasp constraints of one operation: every segment's grasps judged along the whole motion (paper, section 5.2)."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gripwright.design import reason
from gripwright.design.contact import Contact, Surface, contacts, forbidden_touch, seat
from gripwright.design.finger_lengths import length_max, length_min
from gripwright.design.gauge import Attempt, Circumstances, Envelopes
from gripwright.design.gripping_surface import gripping_surface
from gripwright.design.hand_check import HandCheck, Miss, OperationScene
from gripwright.design.holding import contact_radius_mm, hold
from gripwright.design.holding_load import operation_load
from gripwright.design.nearest_miss import closest_grasp
from gripwright.design.toolbox import Toolbox
from gripwright.domain.affordance import Forbidden
from gripwright.domain.assembly import Component
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import INTERNAL, FreeGrasp, Grasp, GripRequirement, NearestMiss, SegmentVerdict
from gripwright.domain.shape import FloatArray, Mesh, SegmentAnalysis
from gripwright.geometry.measures import submesh
from gripwright.plugin_api import HandModel, RunContext

_ENOUGH, _ENOUGH_TURNING = 48, 12
"""Free grasps of one requirement after which no more are judged: planners name the best of every direction first."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HeldComponent:
    """The component that the gripper holds in an operation, with all that its grasps are judged by."""

    component: Component  # with its prepared mesh
    solid: Mesh  # repaired, few triangles
    forbidden: tuple[Forbidden, ...]
    centroid_C: FloatArray  # (3,) of everything that moves
    mass_kg: float  # of everything that moves
    force_N: float


def judge_segment(
    held: HeldComponent,
    analysis: SegmentAnalysis,
    requirements: Sequence[GripRequirement],
    scene: OperationScene,
    toolbox: Toolbox,
    envelopes: Envelopes,
    ctx: RunContext,
) -> SegmentVerdict:
    """All free grasps on a segment, or the constraint that the most promising grasp failed."""
    judge = _Judge(held, scene, envelopes, ctx)
    free: list[FreeGrasp] = []
    misses: list[Miss] = []
    attempts: list[Attempt] = []
    planned = 0
    answered = requirements[0]
    for requirement in requirements:
        if free and requirement.primitive is not requirements[0].primitive:
            break  # another primitive of the segment is asked only where the first cannot be held
        hand = toolbox.hands[requirement.gripper_type]
        narrow = _too_narrow(requirement, hand, scene.release_clearance_mm)
        if narrow is not None:
            misses.append(narrow)
            continue
        check = HandCheck(scene, hand)
        radius_mm = contact_radius_mm(requirement.primitive, gripping_surface(hand, requirement.grip), ctx.pad)
        for planner in toolbox.planners[requirement.gripper_type]:
            with ctx.timed("grasps.plan"):
                grasps = planner.plan(held.component, analysis.segment, requirement, hand, ctx)
            planned += len(grasps)
            with ctx.timed("constraints.check"):
                found, missed = judge.first_free(grasps, hand, check, radius_mm)
            answered = requirement if found and not free else answered
            free += found
            misses += missed
            attempts.append(Attempt(requirement=requirement, hand=hand, check=check, radius_mm=radius_mm, missed=tuple(missed)))
    nearest = None
    if not free:
        with ctx.timed("constraints.reasons"):
            nearest = _nearest(analysis.segment.id, requirements, attempts, judge, toolbox)
    return SegmentVerdict(
        segment=analysis.segment.id,
        requirement=answered,
        grasps_planned=planned,
        free=tuple(free),
        rejection=None if free else _why_none(requirements, misses, nearest, planned),
        nearest_miss=nearest,
    )


def _nearest(
    segment: int, requirements: Sequence[GripRequirement], attempts: Sequence[Attempt], judge: "_Judge", toolbox: Toolbox
) -> NearestMiss | None:
    """Of the grasps that failed the one that came closest; of bores that no hand enters the widest."""
    closest = closest_grasp(attempts, judge.circumstances)
    if closest is not None:
        return reason.nearest_miss(closest, segment, judge.component, judge.circumstances.scene)
    clearance_mm = judge.circumstances.scene.release_clearance_mm
    narrow = [(need, toolbox.hands[need.gripper_type]) for need in requirements]
    narrow = [entry for entry in narrow if _too_narrow(*entry, clearance_mm) is not None]
    if not narrow:
        return None
    need, hand = max(narrow, key=lambda entry: entry[0].opening_width_mm)
    return reason.narrow_bore(need, segment, hand.fingers, hand.opening_floor_mm(INTERNAL) + clearance_mm)


class _Judge:
    """Judges one grasp after the other against one operation."""

    def __init__(self, held: HeldComponent, scene: OperationScene, envelopes: Envelopes, ctx: RunContext) -> None:
        self._held, self._scene, self._envelopes, self._ctx = held, scene, envelopes, ctx
        self.component = held.component.id
        self._load = operation_load(scene.motion, scene.X_PC, held.centroid_C, held.mass_kg, held.force_N)
        self._surface = Surface(held.solid)
        self._regions = [
            (region, Surface(submesh(held.component.mesh, np.flatnonzero(region.faces))))
            for region in held.forbidden
            if region.faces.any()
        ]
        self.circumstances = Circumstances(
            scene=scene,
            surface=self._surface,
            regions=self._regions,
            load=self._load,
            friction=held.component.friction,
            min_contact_mm=ctx.min_contact_mm,
            envelopes=envelopes,
            pad=ctx.pad,
        )

    def first_free(
        self, grasps: Sequence[Grasp], hand: HandModel, check: HandCheck, radius_mm: float
    ) -> tuple[list[FreeGrasp], list[Miss]]:
        """The first `_ENOUGH` free grasps in the planner's order, and why those before them are not free."""
        free: list[FreeGrasp] = []
        misses: list[Miss] = []
        for grasp, rough in zip(grasps, check.roughs(grasps, self._ctx.min_contact_mm), strict=True):
            verdict = rough or self._judge(grasp, hand, check, radius_mm)
            if isinstance(verdict, Miss):
                misses.append(replace(verdict, grasp=grasp))
                continue
            free.append(verdict)
            if len(free) == (_ENOUGH_TURNING if check.turning else _ENOUGH):
                break
        return free, misses

    def _judge(self, grasp: Grasp, hand: HandModel, check: HandCheck, radius_mm: float) -> FreeGrasp | Miss:
        tips = self._ctx.min_contact_mm
        seated = seat(grasp, self._surface, hand)
        if isinstance(seated, Rejection):
            return Miss(stage=5, code=seated.code, detail=seated.detail)
        touched = forbidden_touch(seated, self._regions, hand, tips)
        if touched is not None:
            return Miss(stage=5, code=touched.code, detail=touched.detail)
        widths = self._envelopes(seated.gripper_type, seated.opening_width_mm)
        if len(widths) == 0:
            detail = f"no actuator at hand holds {seated.gripper_type} at {seated.opening_width_mm:.2f} mm"
            return Miss(stage=6, code="too-wide", detail=detail)
        lengths, miss = length_min(check, seated, widths, tips)
        if miss is not None:
            return miss
        least = float(lengths[0])
        touching = contacts(seated, self._surface, hand, least, self._ctx.min_contact_mm)
        if isinstance(touching, Rejection):
            return Miss(stage=7, code=touching.code, detail=touching.detail)
        miss = check.seated(seated, least)
        if miss is not None:
            return Miss(stage=8, code=miss.code, detail=miss.detail)
        return self._bounded(seated, hand, check, widths, lengths, touching, radius_mm)

    def _bounded(
        self,
        grasp: Grasp,
        hand: HandModel,
        check: HandCheck,
        envelopes: FloatArray,
        lengths: FloatArray,
        touching: tuple[Contact, ...],
        radius_mm: float,
    ) -> FreeGrasp | Miss:
        longest = length_max(check, grasp, float(lengths[0]))
        lengths = np.where(lengths <= longest, lengths, np.inf)
        reach = float(min(longest, lengths[np.isfinite(lengths)].max()))
        touched = forbidden_touch(grasp, self._regions, hand, reach)
        if touched is not None:
            return Miss(stage=9, code=touched.code, detail=touched.detail)
        held = hold(grasp, touching, radius_mm, self._load, self._held.component.friction, self._ctx.pad)
        if not np.isfinite(held.required_force_N):
            detail = f"no grip force holds it: at friction {self._held.component.friction:g} the squeezed surfaces slip out"
            return Miss(stage=10, code="not-held", detail=detail)
        return FreeGrasp(
            grasp=grasp,
            envelopes_mm=envelopes,
            finger_length_min_mm=lengths,
            finger_length_max_mm=longest,
            release_opening_mm=grasp.opening_width_mm
            + (1.0 if grasp.grip == "external" else -1.0) * self._scene.release_clearance_mm,
            rise=float((self._scene.motion[-1] @ self._scene.X_PC @ grasp.X_CG)[2, 2]),
            gap_mm=check.gap(grasp, reach, 10.0),
            hold=held,
        )


def _too_narrow(requirement: GripRequirement, hand: HandModel, release_clearance_mm: float) -> Miss | None:
    """Why the fingers do not fit into a bore, however they are put."""
    if requirement.grip != INTERNAL:
        return None
    least = hand.opening_floor_mm(INTERNAL) + release_clearance_mm
    if requirement.opening_width_mm >= least:
        return None
    detail = (
        f"the bore of diameter {requirement.opening_width_mm:.2f} mm is too narrow for {hand.fingers} fingers: "
        f"closed to let go they need {least:.2f} mm"
    )
    return Miss(stage=0, code="too-narrow", detail=detail)


def _why_none(
    requirements: Sequence[GripRequirement], misses: Sequence[Miss], nearest: NearestMiss | None, planned: int
) -> Rejection:
    """The constraint that the grasp misses that came closest, as a sentence; where none was measured, what most grasps failed."""
    if nearest is not None:
        among = f" (the closest found of {planned} grasps)" if planned > 1 else ""
        return Rejection(nearest.code, f"{nearest.sentence}{among}")
    if not misses:
        widths = ", ".join(f"{need.opening_width_mm:.1f} mm" for need in requirements)
        return Rejection("no-contact", f"no pair of parallel facets, or no height, to grasp at {widths}")
    best = max(miss.stage for miss in misses)
    counts: Mapping[Miss, int] = Counter(miss for miss in misses if miss.stage == best)
    miss, count = max(counts.items(), key=lambda item: item[1])
    return Rejection(miss.code, f"{miss.detail} ({count} of {len(misses)} grasps fail so, no grasp comes further)")
