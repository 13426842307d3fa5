import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from fitting_cases import random_rotation, segment_of
from gripwright.design.stages.affordance import forbidden, segment_forbidden
from gripwright.domain.affordance import Forbidden
from gripwright.domain.assembly import Component, GraspRegion
from gripwright.domain.shape import Mesh, Segment
from gripwright.plugin_api import Params, RunContext
from gripwright_builtin.affordance.marked import MarkedRegions
from gripwright_builtin.affordance.teeth import TeethDetector, TeethParams
from gripwright_builtin.affordance.threads import ThreadDetector, ThreadParams

MARKED, THREADS, TEETH = MarkedRegions(Params()), ThreadDetector(ThreadParams()), TeethDetector(TeethParams())
REPOSITORY = Path(__file__).parents[2]
SHARED = REPOSITORY.parent / "shared" / "data"
PUMP = REPOSITORY / "service" / "gripwright" / "samples" / "pump"
HAVE = {
    "as1/bolt": [],
    "as1/l-bracket": [],
    "as1/nut": [],
    "as1/plate": [],
    "as1/rod": [],
    "bolt-nut-m16/bolt-m16": ["threads"],
    "bolt-nut-m16/nut-m16": ["threads"],
    "counter-plate-screws/91771a542-18-8-ss-flat-head-phillips-machine-screw": ["threads"],
    "counter-plate-screws/counterx": [],
    "industreal-gears/gear-base": [],
    "industreal-gears/gear-large": ["teeth"],
    "industreal-gears/gear-medium": ["teeth"],
    "industreal-gears/gear-small": ["teeth"],
}


def component_of(shape: trimesh.Trimesh | Mesh) -> tuple[Component, list[Segment]]:
    """A component with one segment, all of it."""
    mesh = shape if isinstance(shape, Mesh) else Mesh(vertices_mm=np.array(shape.vertices), faces=np.array(shape.faces, np.int64))
    component = Component(id="c", mesh=mesh, X_PC=np.eye(4))
    return component, [segment_of(mesh, np.arange(len(mesh.faces)))]


def threaded(
    pitch: float = 2.0, starts: int = 1, hand: int = 1, lead_in: float = 5.0, turns: float = 8.0, bore: bool = False
) -> Mesh:
    """A rod (or a bore) of diameter 16 whose upper part carries a 60° thread."""
    angles = np.linspace(0.0, 2.0 * np.pi, 49)[:-1]
    z = np.arange(0.0, lead_in + turns * pitch, pitch / 12.0)
    A, Z = np.meshgrid(angles, z, indexing="ij")
    phase = np.mod(Z / pitch - hand * starts * A / (2.0 * np.pi), 1.0)
    depth = np.where(lead_in < Z, 0.6 * pitch * 2.0 * np.abs(phase - 0.5), 0.0)
    R = 8.0 - depth
    columns, rows = R.shape
    i, j = np.meshgrid(np.arange(columns), np.arange(rows - 1), indexing="ij")
    k = (i + 1) % columns
    a, b, c, d = i * rows + j, k * rows + j, k * rows + j + 1, i * rows + j + 1
    faces = np.concatenate([np.stack([a, b, c], 2), np.stack([a, c, d], 2)]).reshape(-1, 3)
    points = np.stack([R * np.cos(A), R * np.sin(A), Z], axis=2).reshape(-1, 3)
    return Mesh(vertices_mm=points, faces=(faces[:, ::-1] if bore else faces).astype(np.int64))


def toothed(count: int, inner: bool = False, twist_rad: float = 0.0) -> trimesh.Trimesh:
    """A gear (or ring gear) of that many trapezoidal teeth of module 1, 10 wide."""
    root, tip = count / 2.0 - 1.25, count / 2.0 + 1.0
    step = 2.0 * np.pi / count
    corners = [(root, 0.0), (root, 0.3), (tip, 0.4), (tip, 0.6), (root, 0.7)]
    ring = np.array([[r * np.cos((k + s) * step), r * np.sin((k + s) * step)] for k in range(count) for r, s in corners[:-1]])
    outline = trimesh.path.polygons.Polygon(ring)
    if inner:
        outline = (
            trimesh.path.polygons.Polygon([(2 * tip * np.cos(t), 2 * tip * np.sin(t)) for t in np.linspace(0, 6.2, 40)]) - outline
        )
    gear = trimesh.creation.extrude_polygon(outline, 10.0).subdivide_to_size(3.0)
    turn = twist_rad * gear.vertices[:, 2] / 10.0
    x, y = gear.vertices[:, 0].copy(), gear.vertices[:, 1].copy()
    gear.vertices[:, 0], gear.vertices[:, 1] = x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn)
    return gear


def grooved() -> Mesh:
    """A rod with rings instead of a helix."""
    return threaded(starts=0)


def perforated() -> trimesh.Trimesh:
    """A plate with twelve holes on a circle."""
    plate = trimesh.creation.cylinder(30.0, 6.0, sections=64)
    holes = [
        trimesh.creation.cylinder(
            2.0, 10.0, sections=24, transform=trimesh.transformations.translation_matrix([22 * np.cos(t), 22 * np.sin(t), 0])
        )
        for t in np.linspace(0, 2 * np.pi, 13)[:-1]
    ]
    return trimesh.boolean.difference([plate, *holes])


def detected(shape: trimesh.Trimesh | Mesh) -> list[Forbidden]:
    component, segments = component_of(shape)
    return [*THREADS.detect(component, segments, RunContext()), *TEETH.detect(component, segments, RunContext())]


@pytest.mark.parametrize(("pitch", "starts", "hand"), [(2.0, 1, 1), (1.0, 1, -1), (2.0, 2, 1)])
@pytest.mark.parametrize("bore", [False, True])
def test_a_thread_is_found_with_its_pitch_starts_hand_and_side(pitch: float, starts: int, hand: int, bore: bool) -> None:
    mesh = threaded(pitch, starts, hand, bore=bore)
    R = random_rotation(np.random.default_rng(4))
    moved = Mesh(vertices_mm=mesh.vertices_mm @ R.T + [5.0, -3.0, 8.0], faces=mesh.faces)

    [thread] = detected(moved)

    assert thread.detector == "threads"
    assert thread.evidence["pitch"] == pytest.approx(pitch, rel=0.02)
    assert thread.evidence["starts"] == starts
    assert thread.evidence["hand"] == ("right" if hand > 0 else "left")
    assert thread.evidence["external"] is not bore
    along = mesh.triangles_mm[:, :, 2].mean(axis=1)
    assert thread.faces[along > 5.0 + pitch].mean() > 0.95
    assert not thread.faces[along < 5.0 - 2.0 * pitch].any()


@pytest.mark.parametrize("count", [12, 20, 57])
@pytest.mark.parametrize("inner", [False, True])
def test_teeth_are_found_and_counted(count: int, inner: bool) -> None:
    [teeth] = detected(toothed(count, inner))

    assert teeth.detector == "teeth"
    assert teeth.evidence["count"] == count
    assert teeth.evidence["external"] is not inner


def test_helical_teeth_are_counted_as_well() -> None:
    [teeth] = detected(toothed(24, twist_rad=0.2))

    assert teeth.evidence["count"] == 24


@pytest.mark.parametrize(
    "shape",
    [
        grooved(),
        perforated(),
        trimesh.creation.cylinder(10.0, 8.0, sections=6),
        trimesh.creation.cylinder(10.0, 30.0, sections=64),
        trimesh.creation.cone(10.0, 20.0).subdivide(),
        trimesh.creation.box((10.0, 20.0, 30.0)).subdivide().subdivide(),
        trimesh.creation.icosphere(3),
        trimesh.creation.torus(20.0, 5.0),
    ],
    ids=["rings", "holes in a circle", "hexagon", "rod", "cone", "block", "ball", "torus"],
)
def test_other_shapes_have_neither_threads_nor_teeth(shape: trimesh.Trimesh | Mesh) -> None:
    assert detected(shape) == []


@pytest.mark.parametrize("name", HAVE)
def test_real_components_have_the_threads_and_teeth_that_an_engineer_sees(name: str) -> None:
    file = SHARED / f"{name}.stl"
    if not file.exists():
        if os.environ.get("CI") == "true":
            pytest.fail(f"{file} is missing")
        pytest.skip("the shared data are not beside the repository")

    assert [region.detector for region in detected(trimesh.load(file))] == HAVE[name]


@pytest.mark.parametrize("file", sorted(PUMP.glob("*.stl")), ids=lambda file: file.stem)
def test_of_the_sample_the_shaft_has_a_thread_and_gear_and_pinion_have_teeth(file: Path) -> None:
    expected = {"shaft": ["threads"], "gear": ["teeth"], "gear-block": ["teeth"]}

    assert [region.detector for region in detected(trimesh.load(file))] == expected.get(file.stem, [])


def block(no_grasp: Sequence[GraspRegion] = (), may_grasp: Sequence[GraspRegion] = ()) -> tuple[Component, list[Segment]]:
    """A block of 10 × 10 × 30 whose two segments are its lower and upper half."""
    shape = trimesh.creation.box((10.0, 10.0, 30.0)).subdivide_to_size(2.0)
    component, _ = component_of(shape)
    upper = shape.triangles_center[:, 2] > 0
    segments = [replace(segment_of(component.mesh, np.flatnonzero(part)), id=k) for k, part in enumerate((~upper, upper))]
    return replace(component, no_grasp=tuple(no_grasp), may_grasp=tuple(may_grasp)), segments


def region(low: float, high: float, reason: str = "teeth") -> GraspRegion:
    return GraspRegion(reason=reason, box_min_C=np.array([-9.0, -9.0, low]), box_max_C=np.array([9.0, 9.0, high]))


def test_a_marked_box_forbids_the_faces_that_reach_into_it_within_the_box() -> None:
    component, segments = block([region(5.0, 20.0)])

    [found] = forbidden(component, segments, {"marked": MARKED}, RunContext())

    top = component.mesh.triangles_mm[:, :, 2].max(axis=1)
    assert np.array_equal(found.faces, top >= 5.0)
    assert found.box_min_C is not None
    assert found.box_min_C[2] == 5.0


def test_a_marked_segment_is_forbidden_as_a_whole_and_the_other_is_not() -> None:
    component, segments = block([GraspRegion(reason="seal", segments=(1,))])

    regions = forbidden(component, segments, {"marked": MARKED}, RunContext())

    assert segment_forbidden(component.mesh, segments[0], regions) is None
    rejection = segment_forbidden(component.mesh, segments[1], regions)
    assert rejection is not None
    assert rejection.code == "no-grasp"
    assert rejection.detail.startswith("seal: 100.0 % of the segment may not be touched")


@pytest.mark.parametrize(("low", "wholly"), [(-1.0, True), (2.0, False)])
def test_a_segment_that_a_box_cuts_is_not_wholly_forbidden(low: float, wholly: bool) -> None:
    component, segments = block([region(low, 20.0)])

    regions = forbidden(component, segments, {"marked": MARKED}, RunContext())

    assert (segment_forbidden(component.mesh, segments[1], regions) is not None) is wholly


class Everything:
    """A detector that forbids all."""

    key = "everything"
    params_model = Params

    def detect(self, component: Component, segments: Sequence[Segment], ctx: RunContext) -> list[Forbidden]:
        return [Forbidden(reason="all", detector=self.key, faces=np.ones(len(component.mesh.faces), dtype=bool))]


def test_what_may_be_grasped_overrules_detectors_but_not_what_is_marked() -> None:
    allowed = [GraspRegion(reason="hardened", segments=(1,))]
    component, segments = block(may_grasp=allowed)
    marked, _ = block([GraspRegion(reason="seal", segments=(1,))], allowed)

    found = forbidden(component, segments, {"everything": Everything()}, RunContext())
    kept = forbidden(marked, segments, {"marked": MARKED}, RunContext())

    assert segment_forbidden(component.mesh, segments[1], found) is None
    assert segment_forbidden(component.mesh, segments[0], found) is not None
    assert segment_forbidden(component.mesh, segments[1], kept) is not None


def test_a_box_frees_the_detected_faces_with_their_centre_in_it() -> None:
    component, segments = block(may_grasp=[region(0.0, 99.0, "hardened")])

    [found] = forbidden(component, segments, {"everything": Everything()}, RunContext())

    assert np.array_equal(found.faces, component.mesh.triangles_mm[:, :, 2].mean(axis=1) < 0.0)
