"""Grasp constraints of one operation: the grasps of every segment judged along the whole motion (paper, section 5.2).

Where none is free, those between the planned ones are judged: ever more finely, until one is free or the finest resolution
is reached.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gripwright.design import reason
from gripwright.design.gauge import PLACED, Attempt
from gripwright.design.grasp_judge import GraspJudge
from gripwright.design.gripping_surface import gripping_surface
from gripwright.design.hand_check import HandCheck, Miss
from gripwright.design.holder import sized_hand
from gripwright.design.holding import contact_radius_mm
from gripwright.design.nearest_miss import closest_grasp
from gripwright.design.places import Places, hopeless
from gripwright.design.plan_lacks import not_in_plan, planners_of, too_narrow
from gripwright.design.stages.keep import TIE, explained_mm2
from gripwright.design.tapered_hand import tapered
from gripwright.design.toolbox import Toolbox
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import INTERNAL, SURFACE, FreeGrasp, Grasp, GripRequirement, NearestMiss, SegmentVerdict
from gripwright.domain.shape import FloatArray, Primitive, SegmentAnalysis
from gripwright.domain.taper import taper_words
from gripwright.plugin_api import HandModel, RunContext

_MOST_PLACES, _TURNING = 40_000, 20
"""Places between grasps that are looked at in one operation at one resolution, and how many each counts for
where the motion turns. Where more are open, they are not searched more finely."""

_MOST_IN_FULL = 3_000
"""Grasps that pass the checks of the fingers, and are judged in full in one operation, beyond the planned ones; weighed alike."""


@dataclass(slots=True, kw_only=True, eq=False)
class _Search:
    """Grasps of one requirement by one planner: what has been missed, and the places that are still open."""

    requirement: GripRequirement
    hand: HandModel
    check: HandCheck
    radius_mm: float
    planned: list[Miss]  # of the grasps that the planner named
    between: list[Miss]  # of those between them, at the finest resolution so far
    places: Places
    resolution: FloatArray  # (4,) how far grasps that were judged are apart
    open: bool = True  # to a finer search

    def attempt(self) -> Attempt:
        """For the reasons."""
        return Attempt(
            requirement=self.requirement,
            hand=self.hand,
            check=self.check,
            radius_mm=self.radius_mm,
            missed=(*self.planned, *self.between),
        )


@dataclass(slots=True, kw_only=True)
class _Budget:
    """What may still be spent on the grasps between the planned ones."""

    places: int
    in_full: int


class SegmentSearch:
    """The search for free grasps on one segment: the planned ones first, then those between them."""

    def __init__(
        self,
        analysis: SegmentAnalysis,
        requirements: Sequence[GripRequirement],
        judge: GraspJudge,
        toolbox: Toolbox,
        ctx: RunContext,
    ) -> None:
        self._analysis, self._requirements, self._judge, self._toolbox, self._ctx = analysis, requirements, judge, toolbox, ctx
        self.free: list[FreeGrasp] = []
        self._searches: list[_Search] = []
        self._narrow: list[Miss] = []
        self._lacking: list[Miss] = []  # what the plan lacks to hold as its rules ask
        self._count = 0
        self._answered = requirements[0]

    def planned(self) -> None:
        """Judge the grasps that the planners name, once."""
        if self._searches or self._narrow or self._lacking:
            return
        scene = self._judge.circumstances.scene
        settled = False
        for requirement in self._requirements:
            if requirement.grip == SURFACE:  # every size of a face, for the set to choose from
                if any(_is_of_size(free.grasp, requirement) for free in self.free):
                    continue
            else:  # a poorer primitive of the segment is asked only where the first cannot be held
                held = any(free.grasp.grip != SURFACE for free in self.free)
                settled = settled or (held and not self._is_as_good_as_the_first(requirement.primitive))
                if settled:
                    continue
            lacking = not_in_plan(requirement, self._toolbox)
            if lacking is not None:
                self._lacking.append(lacking)
                continue
            hand = sized_hand(self._toolbox.hands[requirement.gripper_type], requirement.opening_width_mm)
            hand = tapered(hand, requirement.taper_rad, requirement.vee)
            narrow = too_narrow(requirement, hand, scene.release_clearance_mm)
            if narrow is not None:
                self._narrow.append(narrow)
                continue
            check = HandCheck(scene, hand)
            radius_mm = np.inf
            if requirement.grip != SURFACE:
                radius_mm = contact_radius_mm(requirement.primitive, gripping_surface(hand, requirement.grip), self._ctx.pad)
            for planner in planners_of(requirement, self._toolbox):
                with self._ctx.timed("grasps.plan"):
                    grasps = planner.plan(self._judge.held.component, self._analysis.segment, requirement, hand, self._ctx)
                    grasps = [_tipped(grasp, requirement) for grasp in grasps]
                with self._ctx.timed("constraints.check"):
                    free, missed = self._judge.first_free(grasps, hand, check, radius_mm)
                places = Places.of(grasps)
                self._searches.append(
                    _Search(
                        requirement=requirement,
                        hand=hand,
                        check=check,
                        radius_mm=radius_mm,
                        planned=missed,
                        between=[],
                        places=places,
                        resolution=places.extents.max(axis=0, initial=0.0),
                    )
                )
                self._count += len(grasps)
                self._found(requirement, free)

    def _is_as_good_as_the_first(self, primitive: Primitive) -> bool:
        """Whether as much of the segment lies on it as on the first: a box and a profile may say the same of a plate."""
        first, mesh, segment = self._requirements[0].primitive, self._judge.held.component.mesh, self._analysis.segment
        if primitive is first:
            return True
        return 0.0 < explained_mm2(primitive, segment, mesh) >= (1.0 - TIE) * explained_mm2(first, segment, mesh)

    @property
    def resolution(self) -> FloatArray:
        """How far grasps that were judged may be apart: about x and z (rad), along y and z (mm)."""
        return np.asarray(np.max([np.zeros(4), *(search.resolution for search in self._searches)], axis=0))

    def between(self, size: FloatArray, budget: _Budget) -> None:
        """Judge the grasps between those judged before, until none are farther apart than `size`, as far as the budget goes."""
        with self._ctx.timed("constraints.finer"):
            for search in self._searches:
                if search.open:
                    self._between(search, size, budget)

    def _between(self, search: _Search, size: FloatArray, budget: _Budget) -> None:
        places = search.places.halved(size)
        weight = _TURNING if search.check.turning else 1
        search.open = len(places) * weight <= budget.places
        if not search.open:
            return
        budget.places -= len(places) * weight
        scene, tips_mm = self._judge.circumstances.scene, self._ctx.min_contact_mm
        blocked = hopeless(places, places.middles(), search.hand, scene, tips_mm)
        self._count += int(blocked.sum())
        places = places.kept(~blocked)
        grasps = places.kept(places.fresh).middles()
        free, missed = self._judge.first_free(grasps, search.hand, search.check, search.radius_mm, budget.in_full // weight)
        search.places, search.between = replace(places, fresh=np.zeros(len(places), dtype=bool)), missed
        self._count += len(grasps)
        self._found(search.requirement, free)
        budget.in_full -= weight * (len(free) + sum(miss.stage >= PLACED for miss in missed))
        search.open = bool(free) or len(missed) == len(grasps)
        if search.open:
            search.resolution = np.minimum(search.resolution, size)

    def verdict(self, searched: str) -> SegmentVerdict:
        """All free grasps, or the constraint that the most promising grasp failed; `searched`: to which resolution."""
        nearest, rejection = None, None
        if not self.free:
            with self._ctx.timed("constraints.reasons"):
                nearest = self._nearest()
            rejection = self._why_none(nearest, searched if any(len(search.planned) for search in self._searches) else "")
        return SegmentVerdict(
            segment=self._analysis.segment.id,
            requirement=self._answered,
            grasps_planned=self._count,
            free=tuple(self.free),
            rejection=rejection,
            nearest_miss=nearest,
            searched=searched,
        )

    def _found(self, requirement: GripRequirement, free: Sequence[FreeGrasp]) -> None:
        self._answered = requirement if free and not self.free else self._answered
        self.free += [replace(grasp, preferences=requirement.preferences) for grasp in free] if requirement.preferences else free

    def _nearest(self) -> NearestMiss | None:
        """Of the grasps that failed the one that came closest; of bores that no hand enters the widest."""
        around, segment = self._judge.circumstances, self._analysis.segment.id
        closest = closest_grasp([search.attempt() for search in self._searches], around)
        if closest is not None:
            return reason.nearest_miss(closest, segment, self._judge.held.component.id, around.scene)
        clearance_mm = around.scene.release_clearance_mm
        known = [need for need in self._requirements if not_in_plan(need, self._toolbox) is None]
        narrow = [(need, self._toolbox.hands[need.gripper_type]) for need in known]
        narrow = [entry for entry in narrow if too_narrow(*entry, clearance_mm) is not None]
        if not narrow:
            return None
        need, hand = max(narrow, key=lambda entry: entry[0].opening_width_mm)
        return reason.narrow_bore(need, segment, hand.fingers, hand.opening_floor_mm(INTERNAL) + clearance_mm)

    def _why_none(self, nearest: NearestMiss | None, searched: str) -> Rejection:
        """The constraint that the grasp misses that came closest, in words; where none was measured, what most grasps failed."""
        lacking = "".join(f"; {detail}" for detail in dict.fromkeys(miss.detail for miss in self._lacking))
        if nearest is not None:
            among = f"the closest found of {self._count} grasps" if self._count > 1 else ""
            told = "; ".join(part for part in (among, searched) if part)
            return Rejection(nearest.code, (f"{nearest.sentence} ({told})" if told else nearest.sentence) + lacking)
        misses = [
            *self._narrow,
            *self._lacking,
            *(miss for search in self._searches for miss in (*search.planned, *search.between)),
        ]
        if not misses:
            return Rejection("no-contact", "; ".join(dict.fromkeys(self._unplanned(need) for need in self._requirements)))
        best = max(miss.stage for miss in misses)
        counts: Mapping[Miss, int] = Counter(miss for miss in misses if miss.stage == best)
        miss, count = max(counts.items(), key=lambda item: item[1])
        return Rejection(miss.code, f"{miss.detail} ({count} of {len(misses)} grasps fail so, no grasp comes further)")

    def _unplanned(self, need: GripRequirement) -> str:
        asked = ", ".join(planner.key for planner in planners_of(need, self._toolbox))
        what = f"{asked} plans no grasp for {need.rule} on the {need.primitive.kind} at {need.opening_width_mm:.1f} mm"
        return f"{what}, {taper_words(need.taper_rad)}" if need.taper_rad else f"{what}: no parallel facets, or no height"


def search_between(segments: Sequence[SegmentSearch], finest: FloatArray, progress: Callable[[int], None]) -> str:
    """Search between the planned grasps of a component; to which resolution, in words ("": no segment has a grasp to go by).

    `finest` is how far grasps are apart in the end: turned about x and z (rad), shifted along y and z (mm).
    """
    for number, segment in enumerate(segments):
        segment.planned()
        progress(number)
    if any(segment.free for segment in segments):
        return ""
    budget = _Budget(places=_MOST_PLACES, in_full=_MOST_IN_FULL)
    apart = max((segment.resolution / finest).max() for segment in segments) if segments else 0.0
    for level in reversed(range(int(np.ceil(np.log2(max(apart, 1.0)) - 1e-9)))):
        budget.places = _MOST_PLACES
        for segment in segments:
            segment.between(finest * 2.0**level, budget)
            progress(len(segments) - 1)
        if any(segment.free for segment in segments):
            break
    resolution = np.max([np.zeros(4), *(segment.resolution for segment in segments)], axis=0)
    return _words(resolution) if resolution.any() else ""


def _words(resolution: FloatArray) -> str:
    return f"searched to {np.degrees(resolution[:2]).max():.1f}°, {resolution[2:].max():.2g} mm"


def _tipped(grasp: Grasp, requirement: GripRequirement) -> Grasp:
    """The grasp with tips as its requirement asks for."""
    if not requirement.taper_rad and requirement.vee is None:
        return grasp
    return replace(grasp, taper_rad=requirement.taper_rad, vee=requirement.vee)


def _is_of_size(grasp: Grasp, requirement: GripRequirement) -> bool:
    same_type = (grasp.gripper_type, grasp.grip) == (requirement.gripper_type, requirement.grip)
    return same_type and grasp.opening_width_mm == requirement.opening_width_mm
