"""Judges grasps on one component against one operation, one after the other, until enough of them are free."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gripwright.design.contact import forbidden_touch
from gripwright.design.finger_lengths import length_max, length_min
from gripwright.design.gauge import Circumstances, Envelopes
from gripwright.design.hand_check import HandCheck, Miss, OperationScene
from gripwright.design.holder import Holder, Models, least_length_mm
from gripwright.design.holding_load import operation_load
from gripwright.design.tapered_hand import leaving_mm, thicker_mm
from gripwright.domain.affordance import Forbidden
from gripwright.domain.assembly import Component
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import FreeGrasp, Grasp, letting_go
from gripwright.domain.holding import Contact
from gripwright.domain.shape import FloatArray, Mesh
from gripwright.geometry.held_surface import Surface
from gripwright.geometry.measures import submesh
from gripwright.plugin_api import HandModel, RunContext

_ENOUGH, _ENOUGH_TURNING = (36, 12), (9, 3)
"""Free grasps of one requirement after which no more are judged: so many as the planner orders them, which names the best of
every direction first, then so many of the rest, those nearest to the centre of mass of all that moves first: far from it weight
and force tilt the component, and a grasp takes many times the force."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HeldComponent:
    """The component that the gripper holds in an operation, with all that its grasps are judged by."""

    component: Component  # with its prepared mesh
    solid: Mesh  # repaired, few triangles
    forbidden: tuple[Forbidden, ...]
    centroid_C: FloatArray  # (3,) of everything that moves
    mass_kg: float  # of everything that moves
    force_N: float


class GraspJudge:
    """Judges one grasp after the other against one operation."""

    def __init__(
        self, held: HeldComponent, scene: OperationScene, envelopes: Envelopes, ctx: RunContext, models: Models | None = None
    ) -> None:
        self._scene, self._envelopes, self._ctx, self._models = scene, envelopes, ctx, models or {}
        self.held = held
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
            component=held.component,
            envelopes=envelopes,
            models=self._models,
            ctx=ctx,
        )

    def first_free(
        self, grasps: Sequence[Grasp], hand: HandModel, check: HandCheck, radius_mm: float, most_in_full: int | None = None
    ) -> tuple[list[FreeGrasp], list[Miss]]:
        """The first free grasps, `_ENOUGH` of them, and why those that were judged besides are not free.

        Of those that pass the first checks no more than `most_in_full` are judged (None: all).
        """
        free: list[FreeGrasp] = []
        misses: list[Miss] = []
        left, in_full = list(grasps), 0
        for enough in np.cumsum(_ENOUGH_TURNING if check.turning else _ENOUGH).tolist():
            done = 0
            for grasp, rough in zip(left, check.roughs(left, least_length_mm(hand, self._ctx)), strict=True):
                if len(free) == enough or (rough is None and in_full == most_in_full):
                    break
                in_full += rough is None
                verdict = rough or self._judge(grasp, hand, check, radius_mm)
                if isinstance(verdict, Miss):
                    misses.append(replace(verdict, grasp=grasp))
                else:
                    free.append(verdict)
                done += 1
            left = [] if in_full == most_in_full else sorted(left[done:], key=self._off_centre_mm)
        return free, misses

    def _holder(self, grasp: Grasp) -> Holder:
        return Holder(model=self._models.get(grasp.gripper_type), ctx=self._ctx)

    def _off_centre_mm(self, grasp: Grasp) -> float:
        return float(np.linalg.norm(grasp.X_CG[:3, 3] - self.held.centroid_C))

    def _judge(self, grasp: Grasp, hand: HandModel, check: HandCheck, radius_mm: float) -> FreeGrasp | Miss:
        tips, holder = least_length_mm(hand, self._ctx), self._holder(grasp)
        seated = holder.seat(grasp, self._surface, hand)
        if isinstance(seated, Rejection):
            return Miss(stage=5, code=seated.code, detail=seated.detail)
        touched = forbidden_touch(seated, self._regions, hand, tips)
        if touched is not None:
            return Miss(stage=5, code=touched.code, detail=touched.detail)
        widths = self._envelopes(seated.gripper_type, seated.opening_width_mm + 2.0 * thicker_mm(hand))
        if len(widths) == 0:
            detail = f"no actuator at hand holds {seated.gripper_type} at {seated.opening_width_mm:.2f} mm"
            return Miss(stage=6, code="too-wide", detail=detail)
        lengths, miss = length_min(check, seated, widths, tips)
        if miss is not None:
            return miss
        least = float(lengths[0])
        touching = holder.contacts(seated, self._surface, hand, least)
        if isinstance(touching, Rejection):
            return Miss(stage=7, code=touching.code, detail=touching.detail)
        longest, miss = length_max(check, seated, least)
        if miss is not None:
            return Miss(stage=8, code=miss.code, detail=miss.detail)
        return self._bounded(seated, hand, check, widths, lengths, longest, touching, radius_mm)

    def _bounded(
        self,
        grasp: Grasp,
        hand: HandModel,
        check: HandCheck,
        envelopes: FloatArray,
        lengths: FloatArray,
        longest: float,
        touching: tuple[Contact, ...],
        radius_mm: float,
    ) -> FreeGrasp | Miss:
        lengths = np.where(lengths <= longest, lengths, np.inf)
        reach = float(min(longest, lengths[np.isfinite(lengths)].max()))
        touched = forbidden_touch(grasp, self._regions, hand, reach)
        if touched is not None:
            return Miss(stage=9, code=touched.code, detail=touched.detail)
        held = self._holder(grasp).hold(grasp, touching, radius_mm, self._load, self.held.component)
        if isinstance(held, Rejection):
            return Miss(stage=10, code=held.code, detail=held.detail)
        return FreeGrasp(
            grasp=grasp,
            envelopes_mm=envelopes,
            finger_length_min_mm=lengths,
            finger_length_max_mm=longest,
            release_opening_mm=grasp.opening_width_mm
            + letting_go(grasp.grip) * (self._scene.release_clearance_mm + leaving_mm(hand)),
            rise=float((self._scene.motion[-1] @ self._scene.X_PC @ grasp.X_CG)[2, 2]),
            gap_mm=check.gap(grasp, reach, 10.0),
            hold=held,
        )
