"""What a plan lacks, or a bore lacks room for, to hold as a rule asks."""

from gripwright.design.hand_check import Miss
from gripwright.design.toolbox import Toolbox
from gripwright.domain.grasp import INTERNAL, SURFACE, GripRequirement
from gripwright.plugin_api import GraspPlanner, HandModel, grips_of


def planners_of(requirement: GripRequirement, toolbox: Toolbox) -> list[GraspPlanner]:
    """The plan's planners of that type and grip."""
    of_type = toolbox.planners.get(requirement.gripper_type, ())
    return [planner for planner in of_type if requirement.grip in grips_of(planner)]


def not_in_plan(requirement: GripRequirement, toolbox: Toolbox) -> Miss | None:
    """What the plan lacks to hold as a rule of it asks."""
    kind = requirement.gripper_type
    lacks = [] if kind in toolbox.hands else ["hand model"]
    lacks += [] if planners_of(requirement, toolbox) else ["grasp planner"]
    lacks += [] if requirement.grip != SURFACE or kind in toolbox.holding else ["holding model"]
    if not lacks:
        return None
    return Miss(
        stage=0, code="no-type", detail=f"{requirement.rule} asks for {kind}, of which the plan has no {', no '.join(lacks)}"
    )


def too_narrow(requirement: GripRequirement, hand: HandModel, release_clearance_mm: float) -> Miss | None:
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
