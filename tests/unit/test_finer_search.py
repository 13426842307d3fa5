"""Where no planned grasp is free, those in between are searched: a window that the plan misses is found."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import trimesh

from gripwright.design.grasp_judge import GraspJudge
from gripwright.design.scenes import Body, held_component, operation_scene
from gripwright.design.stages.constraints import SegmentSearch, search_between
from gripwright.domain.assembly import Component, Obstacle, Operation
from gripwright.domain.grasp import CENTRIC_3, PARALLEL_2, GripRequirement, SegmentVerdict
from gripwright.domain.shape import Box, Cylinder, Mesh, Segment
from gripwright.plugin_api import RunContext
from gripwright_builtin.hands.centric import CentricHand, CentricSettings
from gripwright_builtin.hands.parallel import ParallelHand
from gripwright_builtin.hands.prism import HandSettings
from gripwright_builtin.planners.axial import AxialPlanner, AxialSettings
from gripwright_builtin.planners.facet_pairs import FacetPairPlanner, FacetPairSettings
from mesh_factory import box_mesh, moved, turned_mesh

FINGER_MM, MARGIN_MM = 10.0, 0.1
FINEST = np.array([np.radians(1.9), np.radians(1.9), 0.65, 0.65])
PLANNERS = {PARALLEL_2: [FacetPairPlanner(FacetPairSettings())], CENTRIC_3: [AxialPlanner(AxialSettings())]}


def mesh_of(body: trimesh.Trimesh) -> Mesh:
    return Mesh(vertices_mm=np.asarray(body.vertices, dtype=float), faces=np.asarray(body.faces, dtype=np.int64))


def searched(held: Mesh, need: GripRequirement, walls: list[Mesh], way: np.ndarray, planners: Any = PLANNERS) -> SegmentVerdict:
    component = Component(id="held", mesh=held, X_PC=np.eye(4), friction=0.5, density_kg_m3=1000.0)
    motion = np.stack([np.eye(4), np.eye(4)])
    motion[0, :3, 3] = way
    operation = Operation(id="op", active=("held",), passive=(), motion=motion)
    obstacles = [Obstacle(id=f"wall-{i}", mesh=wall, X_PE=np.eye(4)) for i, wall in enumerate(walls, start=1)]
    body = Body(component=component, solid=held)
    scene = operation_scene(operation, body, [], [], obstacles, MARGIN_MM, 1.0)
    ctx = RunContext(min_contact_mm=3.0)
    judge = GraspJudge(held_component(operation, body, [], held, ()), scene, lambda kind, width: np.array([15.0]), ctx)
    hands = {PARALLEL_2: ParallelHand(HandSettings()), CENTRIC_3: CentricHand(CentricSettings())}
    toolbox: Any = SimpleNamespace(hands=hands, planners=planners)
    faces = np.arange(len(held.faces))
    analysis: Any = SimpleNamespace(segment=Segment(id=0, faces=faces, area_mm2=1.0, hull_volume_mm3=1.0))
    search = SegmentSearch(analysis, [need], judge, toolbox, ctx)
    words = search_between([search], FINEST, lambda number: None)
    return search.verdict(words)


def slotted(width: float, tilt_deg: float, aside: float) -> tuple[Mesh, GripRequirement, list[Mesh], np.ndarray]:
    """A block 20 × 30 × 30 between walls that leave a slot on each side, tilted in the walls' plane: its way in and out."""
    X = np.eye(4)
    X[:3, 3] = [-10.0, -15.0, -15.0]
    held = moved(box_mesh((20.0, 30.0, 30.0)), X)
    tilt = trimesh.transformations.rotation_matrix(np.radians(tilt_deg), [1.0, 0.0, 0.0])
    slot = trimesh.creation.box([200.0, width, 200.0])
    slot.apply_translation([0.0, aside, 92.0])
    slot.apply_transform(tilt)
    walls = []
    for side in (-1.0, 1.0):
        wall = trimesh.creation.box([20.0, 160.0, 80.0])
        wall.apply_translation([side * 20.2, 0.0, 10.0])
        walls.append(mesh_of(trimesh.boolean.difference([wall, slot])))
    box = Box(X_CB=np.eye(4), extents_mm=np.array([20.0, 30.0, 30.0]), filled=np.ones(6), filled_min=0.5, rms_mm=0.0)
    need = GripRequirement(
        gripper_type=PARALLEL_2, opening_width_mm=20.0, approach_C=np.zeros((0, 3)), grip_axes_C=np.eye(3)[:1], primitive=box
    )
    return held, need, walls, 100.0 * tilt[:3, 2]


@pytest.mark.parametrize(("tilt_deg", "aside"), [(20.0, 1.2), (-39.0, 0.0), (8.0, -2.4)])
def test_a_slot_that_lies_between_the_planned_grasps_is_found(tilt_deg: float, aside: float) -> None:
    verdict = searched(*slotted(FINGER_MM + 2.0, tilt_deg, aside))

    assert verdict.rejection is None
    tilts = [np.degrees(np.arctan2(free.grasp.X_CG[1, 2], -free.grasp.X_CG[2, 2])) for free in verdict.free]
    assert tilts == pytest.approx(np.full(len(tilts), tilt_deg), abs=3.0)
    assert all(free.grasp.label.count(",") > 2 for free in verdict.free)  # none of them was planned


def test_without_leeway_the_planned_grasps_alone_are_judged() -> None:
    class Coarse:
        def plan(self, *arguments: Any) -> Any:
            return [replace(grasp, leeway=None) for grasp in PLANNERS[PARALLEL_2][0].plan(*arguments)]

    verdict = searched(*slotted(FINGER_MM + 2.0, 20.0, 1.2), planners={PARALLEL_2: [Coarse()]})

    assert verdict.rejection is not None
    assert "searched" not in verdict.rejection.detail


def test_where_the_slot_is_narrower_than_the_finger_the_sentence_says_how_finely_was_searched() -> None:
    verdict = searched(*slotted(FINGER_MM - 0.5, 20.0, 1.2))

    assert verdict.rejection is not None
    assert verdict.rejection.detail.endswith("searched to 1.9°, 0.65 mm)")
    assert verdict.free == ()


@pytest.mark.parametrize(("width", "held_there"), [(FINGER_MM + 1.2, True), (FINGER_MM - 0.5, False)])
def test_three_gaps_between_the_planned_rotations_are_found(width: float, held_there: bool) -> None:
    held = turned_mesh(((0.0, 0.0), (12.0, 0.0), (12.0, 30.0), (0.0, 30.0)), 96)
    low, high = held.vertices_mm[:, 2].min(), held.vertices_mm[:, 2].max()
    tower = trimesh.creation.annulus(
        r_min=12.3, r_max=40.0, height=50.0, transform=trimesh.transformations.translation_matrix([0, 0, high - 10.0])
    )
    gaps = []
    for turn in (0.0, 120.0, 240.0):
        gap = trimesh.creation.box([100.0, width, 100.0])
        gap.apply_translation([50.0, 0.0, high])
        gap.apply_transform(trimesh.transformations.rotation_matrix(np.radians(turn + 7.5), [0.0, 0.0, 1.0]))
        gaps.append(gap)
    walls = [mesh_of(trimesh.boolean.difference([tower, *gaps]))]
    axis = np.array([0.0, 0.0, 1.0])
    cylinder = Cylinder(
        axis_C=axis,
        center_C=axis * (low + high) / 2.0,
        radius_mm=12.0,
        height_mm=high - low,
        rms_mm=0.0,
        internal=False,
        arc_rad=2.0 * np.pi,
        surface_filled=True,
    )
    need = GripRequirement(
        gripper_type=CENTRIC_3,
        opening_width_mm=24.0,
        approach_C=np.stack([-axis, axis]),
        grip_axes_C=np.zeros((0, 3)),
        primitive=cylinder,
    )

    verdict = searched(held, need, walls, np.array([0.0, 0.0, 100.0]))

    assert bool(verdict.free) is held_there
    assert (verdict.rejection is None) is held_there


def test_of_many_free_grasps_those_near_the_centre_of_mass_are_among_the_judged() -> None:
    X = np.eye(4)
    X[:3, 3] = [-10.0, -60.0, -60.0]
    held = moved(box_mesh((20.0, 120.0, 120.0)), X)  # the centre of mass lies in the origin, 60 mm from every edge
    box = Box(X_CB=np.eye(4), extents_mm=np.array([20.0, 120.0, 120.0]), filled=np.ones(6), filled_min=0.5, rms_mm=0.0)
    need = GripRequirement(
        gripper_type=PARALLEL_2, opening_width_mm=20.0, approach_C=np.zeros((0, 3)), grip_axes_C=np.eye(3)[:1], primitive=box
    )

    verdict = searched(held, need, [], np.array([0.0, 0.0, 100.0]))

    off = np.array([np.linalg.norm(free.grasp.X_CG[:3, 3]) for free in verdict.free])
    force = np.array([free.hold.required_force_N for free in verdict.free])
    assert 36 < len(off) < verdict.grasps_planned  # more would be free
    assert off[:36].min() > 40.0
    assert off.min() < 10.0
    assert force.min() < force[:36].min() / 3.0
