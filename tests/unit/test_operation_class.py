"""The kinds of assembly operation, told from motion and contact of solids built here."""

import time

import manifold3d
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gripwright.design.operation_class import (
    DEFAULT_FORCE_N,
    MESHING,
    PEG_IN_HOLE,
    PLACING,
    PRESS_FIT,
    SCREWING,
    UNKNOWN,
    OperationClass,
    PlacedComponent,
    classify,
)
from gripwright.domain.affordance import Forbidden
from gripwright.domain.shape import FloatArray, Mesh


def placed(solid: manifold3d.Manifold, name: str = "it", forbidden: tuple[Forbidden, ...] = ()) -> PlacedComponent:
    """A solid at its place."""
    return PlacedComponent(id=name, mesh=_mesh(solid), X_PC=np.eye(4), forbidden=forbidden)


def lowered(direction: tuple[float, float, float] = (0.0, 0.0, -1.0), way_mm: float = 60.0) -> FloatArray:
    """A straight motion that ends at home."""
    motion = np.tile(np.eye(4), (2, 1, 1))
    motion[0, :3, 3] = -way_mm * np.array(direction)
    return motion


def block() -> manifold3d.Manifold:
    """A block 40 × 40 × 20 below z = 0."""
    return manifold3d.Manifold.cube([40.0, 40.0, 20.0], True).translate([0.0, 0.0, -10.0])


def peg(radius_mm: float, sections: int = 64) -> manifold3d.Manifold:
    """A peg along z from −15 to 10."""
    return manifold3d.Manifold.cylinder(25.0, radius_mm, radius_mm, sections).translate([0.0, 0.0, -15.0])


def bored(radius_mm: float, x_mm: float = 0.0, sections: int = 64) -> manifold3d.Manifold:
    """The block with a hole 15 deep."""
    return block() - peg(radius_mm, sections).translate([x_mm, 0.0, 0.0])


@pytest.mark.parametrize("sections", [12, 64, 256])
def test_a_peg_in_a_hole_of_its_size_is_known_with_its_axis_and_radius(sections: int) -> None:
    hole = placed(bored(8.1, 5.0, sections))

    found = classify(lowered(), None, [placed(peg(8.0, sections).translate([5.0, 0.0, 0.0]))], [hole])

    assert found.kind == PEG_IN_HOLE
    assert found.axis_P is not None
    assert np.allclose(found.axis_P[0, :2], [5.0, 0.0], atol=0.1)
    assert np.allclose(found.axis_P[1], [0.0, 0.0, -1.0])
    assert found.evidence["radius"] == pytest.approx(8.0, abs=0.3)
    assert found.evidence["depth"] == pytest.approx(15.0, abs=1.0)  # to the distance of samples


def test_a_ring_put_over_a_peg_is_peg_in_hole_too() -> None:
    ring = placed(peg(14.0) - peg(8.1).scale([1.0, 1.0, 1.5]))

    assert classify(lowered(), None, [ring], [placed(peg(8.0))]).kind == PEG_IN_HOLE


def test_a_square_peg_in_a_square_hole_is_peg_in_hole() -> None:
    square = manifold3d.Manifold.cube([10.0, 10.0, 25.0], True)

    found = classify(lowered(), None, [placed(square)], [placed(block() - square.scale([1.01, 1.01, 1.0]))])

    assert found.kind == PEG_IN_HOLE


def test_a_block_set_on_a_block_is_placing() -> None:
    upper = placed(block().translate([10.0, 0.0, 20.0]))

    found = classify(lowered(), None, [upper], [placed(block())])

    assert found.kind == PLACING
    assert found.evidence["seat_area"] == pytest.approx(30.0 * 40.0, rel=0.1)
    assert found.default_force_N == 0.0


def test_a_block_in_a_corner_is_placing() -> None:
    corner = block().translate([0.0, 0.0, 0.0]) + block().translate([-40.0, 0.0, 20.0])

    assert classify(lowered(), None, [placed(block().translate([0.0, 0.0, 20.0]))], [placed(corner)]).kind == PLACING


def test_what_is_set_down_alone_is_placed() -> None:
    assert classify(lowered(), None, [placed(block())], []).kind == PLACING


def test_a_peg_that_overlaps_its_hole_all_around_is_a_press_fit_unless_a_clearance_is_asked_for() -> None:
    parts = [placed(peg(8.05, 256))], [placed(bored(8.0, sections=256))]

    found = classify(lowered(), None, *parts)

    assert found.kind == PRESS_FIT
    assert found.evidence["overlap"] == pytest.approx(0.05, abs=0.02)
    assert classify(lowered(), "clearance", *parts).kind == PEG_IN_HOLE


def test_a_press_fit_is_what_the_package_says_it_is() -> None:
    assert classify(lowered(), "press", [placed(peg(8.0))], [placed(bored(8.05))]).kind == PRESS_FIT


@pytest.mark.parametrize("hand", [1.0, -1.0])
def test_a_turn_with_advance_is_screwing_with_its_pitch(hand: float) -> None:
    motion = np.tile(np.eye(4), (4, 1, 1))
    for step in range(4):
        left = 3 - step
        motion[step, :3, :3] = Rotation.from_euler("z", hand * 90.0 * left, degrees=True).as_matrix()
        motion[step, 2, 3] = left * 2.0 / 4.0

    found = classify(motion, None, [placed(peg(8.0))], [placed(bored(8.1))])

    assert found.kind == SCREWING
    assert found.evidence["pitch"] == pytest.approx(2.0)
    assert found.axis_P is not None
    assert np.allclose(found.axis_P[1], [0.0, 0.0, -1.0])


def test_gears_whose_teeth_stand_in_each_other_mesh_and_those_apart_do_not() -> None:
    still = placed(_gear(), "still", (_teeth(_gear()),))
    meshed, apart = (_gear(np.pi / 16.0).translate([x_mm, 0.0, 0.0]) for x_mm in (32.2, 45.0))

    assert classify(lowered(), None, [placed(meshed, "it", (_teeth(meshed),))], [still]).kind == MESHING
    assert classify(lowered(), None, [placed(apart, "it", (_teeth(apart),))], [still]).kind != MESHING


def test_what_meets_nothing_or_does_not_move_is_unknown() -> None:
    far = placed(block().translate([0.0, 0.0, 100.0]))

    assert classify(lowered(), None, [far], [placed(block())]).kind == UNKNOWN
    assert classify(np.tile(np.eye(4), (2, 1, 1)), None, [far], [placed(block())]).kind == UNKNOWN


@pytest.mark.parametrize("seed", range(3))
def test_the_kind_does_not_depend_on_where_the_product_stands(seed: int) -> None:
    X = np.eye(4)
    X[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    X[:3, 3] = [100.0, -50.0, 20.0]
    motion = np.array([X @ step @ np.linalg.inv(X) for step in lowered()])
    parts = [PlacedComponent(id="it", mesh=_mesh(solid), X_PC=X) for solid in (peg(8.0), bored(8.1))]

    found = classify(motion, None, parts[:1], parts[1:])

    assert found.kind == PEG_IN_HOLE
    assert found.axis_P is not None
    assert np.allclose(found.axis_P[1], -X[:3, 2])
    assert np.linalg.norm(np.cross(found.axis_P[0] - X[:3, 3], X[:3, 2])) < 0.1


def test_every_kind_has_a_default_force() -> None:
    assert set(DEFAULT_FORCE_N) == {PEG_IN_HOLE, PLACING, SCREWING, PRESS_FIT, MESHING, UNKNOWN}
    assert DEFAULT_FORCE_N[PLACING] == 0.0


def test_meshes_of_50_000_faces_are_classified_within_a_second() -> None:
    parts = [placed(peg(8.0).refine_to_length(0.35))], [placed(bored(8.1).refine_to_length(0.6))]
    assert min(len(one.mesh.faces) for side in parts for one in side) > 20_000

    start = time.perf_counter()
    found: OperationClass = classify(lowered(), None, *parts)

    assert found.kind == PEG_IN_HOLE
    assert time.perf_counter() - start < 1.0


def _mesh(solid: manifold3d.Manifold) -> Mesh:
    mesh = solid.to_mesh64()
    return Mesh(
        vertices_mm=np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3].copy(),
        faces=np.asarray(mesh.tri_verts, dtype=np.int64).copy(),
    )


def _gear(turned_rad: float = 0.0) -> manifold3d.Manifold:
    """16 teeth of module 2: tip radius 17, root radius 14."""
    angles = turned_rad + 2.0 * np.pi * np.arange(64) / 64.0
    radii = np.tile([17.0, 17.0, 14.0, 14.0], 16)
    outline = np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)
    return manifold3d.Manifold.extrude(manifold3d.CrossSection([outline]), 8.0)


def _teeth(solid: manifold3d.Manifold) -> Forbidden:
    mesh = _mesh(solid)
    low, high = mesh.triangles_mm.min(axis=1)[:, 2], mesh.triangles_mm.max(axis=1)[:, 2]
    evidence = {"count": 16, "pitch": 2.0 * np.pi, "tip_diameter": 34.0}
    return Forbidden(reason="gear teeth", detector="teeth", faces=high - low > 1.0, evidence=evidence)
