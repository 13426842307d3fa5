"""What surrounds a hand in the operations of a package, as the calculation builds it."""

from gripwright.design.hand_check import OperationScene
from gripwright.design.plan import Plan, plan_of
from gripwright.design.scenes import Body, operation_scene
from gripwright.design.stage_table import STAGES
from gripwright.domain.assembly import AssemblyTask, Operation
from gripwright.plugin_api import RunContext
from gripwright.registry.building import build_toolbox
from gripwright.registry.discovery import load_registry
from gripwright.registry.plans import effective_plan


def bodies_of(task: AssemblyTask) -> dict[str, Body]:
    """Each component with its repaired mesh."""
    prepare = STAGES["prepare"].function
    toolbox = build_toolbox(effective_plan(plan_of({})), load_registry())
    return {
        one.id: Body(component=one, solid=prepare({"mesh": one.mesh}, plan_of({}), toolbox, RunContext()).solid)
        for one in task.components
    }


def operation_of(task: AssemblyTask, component: str) -> Operation:
    """The operation that moves the component alone."""
    return next(one for one in task.operations if one.active == (component,))


def scene_of(task: AssemblyTask, operation: Operation, bodies: dict[str, Body], component: str, plan: Plan) -> OperationScene:
    """What surrounds the hand that holds the one component that the operation moves."""
    return operation_scene(
        operation,
        bodies[component],
        [],
        [bodies[name] for name in operation.passive],
        [one for one in task.obstacles if one.operations is None or operation.id in one.operations],
        plan.margin,
        plan.release_clearance,
    )
