"""What the report shows: a component by its segments, a gripper, a gripper at its grasp."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from gripwright.cad.colour import segment_colours
from gripwright.design.gripper_assembly import gripper_parts
from gripwright.design.holder import sized_hand
from gripwright.design.memory import Memory
from gripwright.design.miss_document import vee_of_document
from gripwright.design.motion import pose_at
from gripwright.design.result import DesignResult
from gripwright.design.stages.fingers import GripperCad
from gripwright.design.tapered_hand import tapered
from gripwright.domain.assembly import Operation
from gripwright.domain.gripper import Gripper, Handle, without_handles
from gripwright.domain.shape import Analysis, FloatArray, IntArray, Mesh
from gripwright.geometry.drawn import primitive_mesh
from gripwright.geometry.rays import thread_pool
from gripwright.geometry.solids import hull_mesh
from gripwright.plugin_api import HandModel
from gripwright.report.pictures import Shown, picture, shown

_VIEW = (-1.0, 1.4, -0.8)
_HELD = (0.90, 0.62, 0.00)
_STANDING = (0.80, 0.83, 0.86)
_OBSTACLE = (0.62, 0.66, 0.60)
_HAND, _MISSED = (0.35, 0.50, 0.68), (0.80, 0.22, 0.16)
_SHORTEST_MM, _PALM_MM = 15.0, 12.0  # as drawn


@dataclass(frozen=True, slots=True, kw_only=True)
class Views:
    """The pictures (PNG) of a design."""

    components: tuple[bytes, ...]
    primitives: tuple[bytes | None, ...]  # of each component; None where no segment has any that can be shown
    grippers: Mapping[str, bytes]  # by gripper, of those with CAD
    handles: Mapping[str, bytes]  # by operation, of the same
    misses: Mapping[str, bytes]  # by operation, of those without any free grasp


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Drawing:
    """A picture to be drawn of `made_from` and nothing else but the hands."""

    name: str
    made_from: tuple[Any, ...]
    draw: Callable[..., bytes]


def design_views(result: DesignResult, hands: Mapping[str, HandModel], memory: Memory) -> Views:
    """All pictures; what is not remembered is drawn, on all cores. Components of one analysis share one."""
    made = [
        (without_handles(gripper), gripper.handles, cad)
        for gripper, cad in zip(result.grippers, result.cads, strict=True)
        if isinstance(cad, GripperCad)
    ]
    drawings: dict[tuple[str, str | int], _Drawing] = {
        ("component", id(analysis)): _Drawing(
            name="component", made_from=(analysis.mesh, analysis.face_labels), draw=component_view
        )
        for analysis in result.analyses
    }
    for analysis in result.analyses:
        if solids := drawn_primitives(analysis):
            drawings["primitives", id(analysis)] = _Drawing(name="primitives", made_from=(solids,), draw=primitives_view)
    for gripper, handles, cad in made:
        draw = partial(gripper_view, hand=hands[gripper.gripper_type], memory=memory)
        drawings["gripper", gripper.id] = _Drawing(name="gripper", made_from=(gripper, cad), draw=draw)
        for handle in handles:
            draw = partial(handle_view, hand=hands[gripper.gripper_type], memory=memory)
            made_from = (gripper, cad, handle.opening_width_mm, *_at_the_end(result, handle))
            drawings["handle", handle.operation] = _Drawing(name="handle", made_from=made_from, draw=draw)
    for entry in result.document["operations"]:
        if (entry["nearest_miss"] or {}).get("grasp_pose"):
            missed = (entry["nearest_miss"], *_at_the_miss(result, entry["id"], entry["nearest_miss"]))
            drawings["miss", entry["id"]] = _Drawing(name="miss", made_from=missed, draw=partial(miss_view, hands=hands))

    def drawn(drawing: _Drawing) -> bytes:
        return memory.part(drawing.name, drawing.made_from, lambda: drawing.draw(*drawing.made_from))

    with thread_pool() as pool:
        pictures = dict(zip(drawings, pool.map(drawn, drawings.values()), strict=True))
    return Views(
        components=tuple(pictures["component", id(analysis)] for analysis in result.analyses),
        primitives=tuple(pictures.get(("primitives", id(analysis))) for analysis in result.analyses),
        grippers={str(name): png for (kind, name), png in pictures.items() if kind == "gripper"},
        handles={str(name): png for (kind, name), png in pictures.items() if kind == "handle"},
        misses={str(name): png for (kind, name), png in pictures.items() if kind == "miss"},
    )


def component_view(mesh: Mesh, labels: IntArray) -> bytes:
    """The component, each segment in its colour."""
    return picture([shown(mesh, np.eye(4), segment_colours(labels))], direction=_VIEW)


def drawn_primitives(analysis: Analysis) -> dict[int, Mesh]:
    """The kept primitives that say what they look like, by segment."""
    kept = {item.segment.id: primitive_mesh(item.primitive) for item in analysis.segments if item.primitive is not None}
    return {segment: mesh for segment, mesh in kept.items() if mesh is not None}


def primitives_view(solids: Mapping[int, Mesh]) -> bytes:
    """The primitives of a component, each in the colour of its segment."""
    colours = segment_colours(np.array(list(solids)))
    return picture(
        [shown(mesh, np.eye(4), colour) for mesh, colour in zip(solids.values(), colours, strict=True)], direction=_VIEW
    )


def gripper_view(gripper: Gripper, cad: GripperCad, hand: HandModel, memory: Memory) -> bytes:
    """The gripper, open, its fingers pointing down."""
    upside_down = np.diag([1.0, -1.0, -1.0, 1.0])
    return picture(_parts(gripper, cad, hand, memory, gripper.opening_max_mm, upside_down), direction=_VIEW)


def _at_the_end(result: DesignResult, handle: Handle) -> tuple[FloatArray, list[Shown], list[Shown]]:
    """Pose of the gripper at the end of its operation, what it holds, and what stands there."""
    operation = next(item for item in result.task.operations if item.id == handle.operation)
    X_PC = next(component.X_PC for component in result.task.components if component.id == handle.component)
    return operation.motion[-1] @ X_PC @ handle.grasp.X_CG, *_around(result, operation, operation.motion[-1])


def handle_view(
    gripper: Gripper,
    cad: GripperCad,
    opening_mm: float,
    X_PG: FloatArray,
    held: Sequence[Shown],
    standing: Sequence[Shown],
    hand: HandModel,
    memory: Memory,
) -> bytes:
    """The gripper on its component at the end of the operation, among everything that stands there."""
    hand_parts = _parts(gripper, cad, hand, memory, opening_mm, X_PG)
    fingers = [shown(cad.finger.mesh, X_PG @ X_GF, _HELD) for X_GF in hand.finger_poses(opening_mm)]
    focus = np.concatenate([_points(item) for item in [*held, *fingers]])
    return picture([*hand_parts, *held, *standing], direction=_VIEW, focus=focus)


def _at_the_miss(result: DesignResult, operation_id: str, miss: Mapping[str, Any]) -> tuple[FloatArray, list[Shown], list[Shown]]:
    """Pose of the hand where it fails, what it holds, and what stands there."""
    operation = next(item for item in result.task.operations if item.id == operation_id)
    at_start = miss["phase"] in ("taking-up", "closing")
    place = operation.motion[0 if at_start else -1] if miss["place"] is None else pose_at(operation.motion, miss["place"])
    X_PC = next(component.X_PC for component in result.task.components if component.id == miss["component"])
    return place @ X_PC @ np.array(miss["grasp_pose"]), *_around(result, operation, place)


def miss_view(
    miss: Mapping[str, Any], X_PG: FloatArray, held: Sequence[Shown], standing: Sequence[Shown], hands: Mapping[str, HandModel]
) -> bytes:
    """The hand of the grasp that came closest, where it fails: what is in the way of what, and a ring around the place."""
    hand, length = sized_hand(hands[miss["gripper_type"]], miss["opening_width"]), max(miss["finger_length"], _SHORTEST_MM)
    hand = tapered(hand, float(np.radians(miss.get("taper", 0.0))), vee_of_document(miss))
    fingers = [
        shown(hull_mesh(solid.vertices_mm), X_PG @ X_GF, _MISSED if miss["part"] == f"finger {number}" else _HAND)
        for number, X_GF in enumerate(hand.finger_poses(miss["opening_width"]), start=1)
        for solid in hand.finger(length, miss["grip"])
    ]
    palm = [
        shown(hull_mesh(solid.vertices_mm), X_PG, _MISSED if miss["part"] == "the palm" else _HAND)
        for solid in hand.palm(length, miss["palm_radius"] or _SHORTEST_MM, _PALM_MM)
    ]
    focus = np.concatenate([_points(item) for item in [*held, *fingers]])
    mark = None if miss["point"] is None else np.array(miss["point"])
    return picture([*fingers, *palm, *held, *standing], direction=_VIEW, focus=focus, mark=mark)


def _around(result: DesignResult, operation: Operation, place: FloatArray) -> tuple[list[Shown], list[Shown]]:
    """What moves, displaced by `place`, and what stands around in an operation."""
    meshes = {c.id: a.mesh for c, a in zip(result.task.components, result.analyses, strict=True)}
    X_PC = {component.id: component.X_PC for component in result.task.components}
    held = [shown(meshes[name], place @ X_PC[name], _HELD) for name in operation.active]
    standing = [shown(meshes[name], X_PC[name], _STANDING) for name in operation.passive]
    standing += [
        shown(item.mesh, item.X_PE, _OBSTACLE)
        for item in result.task.obstacles
        if item.operations is None or operation.id in item.operations
    ]
    return held, standing


def _parts(gripper: Gripper, cad: GripperCad, hand: HandModel, memory: Memory, opening_mm: float, X: FloatArray) -> list[Shown]:
    made_from = (gripper, cad.finger, cad.measures, cad.spec.jaw, opening_mm)
    parts = memory.part(
        "parts",
        made_from,
        lambda: gripper_parts(gripper, hand, cad.finger, cad.measures, cad.spec.jaw, opening_mm),
    )
    return [shown(part.mesh, X, part.colour) for part in parts]


def _points(item: Shown) -> FloatArray:
    return np.asarray(item.mesh.vertices_mm @ item.X[:3, :3].T + item.X[:3, 3])
