"""Embree and NumPy find the same first hits, and neither lets a ray slip between two faces."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gripwright.domain.shape import FloatArray, Mesh
from gripwright.geometry import rays
from gripwright.geometry.mesh_repair import repaired
from gripwright.geometry.ray_tree import RayTree
from gripwright.geometry.rays import EmbreeTree, RayScene, Tracer, morton_order
from gripwright.plugin_api import RunContext
from gripwright_builtin.segmenters.sdf import SdfSegmenter
from mesh_factory import box_mesh, component_of, plate_with_bosses, sphere_mesh, turned_mesh

pytestmark = pytest.mark.skipif(not rays.EMBREE, reason="there is no wheel of Embree for this platform to compare with")

MESHES: dict[str, Callable[[], Mesh]] = {
    "one face": lambda: Mesh(vertices_mm=np.eye(3), faces=np.array([[0, 1, 2]])),
    "box": lambda: box_mesh((2.0, 3.0, 4.0)),
    "sphere": lambda: sphere_mesh(7.0, 32),
    "plate": lambda: repaired(plate_with_bosses(24)),
    "stepped shaft": lambda: repaired(turned_mesh(((0, 0), (4, 0), (4, 10), (7, 10), (7, 20), (0, 20)), 40)),
}


def _trees(mesh: Mesh) -> tuple[Tracer, Tracer]:
    points = (mesh.vertices_mm - mesh.vertices_mm.mean(axis=0)).astype(np.float32)
    return EmbreeTree(points, mesh.faces), RayTree(points, mesh.faces, morton_order(points[mesh.faces].mean(axis=1)))


def _edge_points(mesh: Mesh, count: int, rng: np.random.Generator) -> FloatArray:
    """Points on edges, among them corners, about the mean of the vertices."""
    face, side = rng.integers(len(mesh.faces), size=count), rng.integers(3, size=count)
    part = rng.choice([0.0, 0.25, 0.5, rng.random()], size=count)[:, None]
    ends = mesh.vertices_mm - mesh.vertices_mm.mean(axis=0)
    return ends[mesh.faces[face, side]] * (1 - part) + ends[mesh.faces[face, (side + 1) % 3]] * part


@settings(max_examples=40, deadline=None)
@given(st.sampled_from(sorted(MESHES)), st.integers(0, 2**32 - 1))
def test_both_find_the_same_first_hits_of_any_rays(name: str, seed: int) -> None:
    mesh, rng = MESHES[name](), np.random.default_rng(seed)
    size = float(np.ptp(mesh.vertices_mm, axis=0).max())
    origins = (rng.normal(size=(500, 3)) * size * rng.choice([0.1, 1.0])).astype(np.float32)
    directions = rng.normal(size=(500, 3)).astype(np.float32)

    (distance, face, normal), (distance_np, face_np, normal_np) = (t.first_hits(origins, directions) for t in _trees(mesh))

    assert ((face < 0) == (face_np < 0)).mean() > 0.995  # a ray that grazes an outline in single precision may do either
    hit = (face >= 0) & (face_np >= 0)
    same = hit & (face == face_np)
    assert same.sum() >= 0.99 * hit.sum() - 1  # the others meet an edge of both faces
    np.testing.assert_allclose(distance_np[same], distance[same], rtol=1e-3, atol=1e-5 * size)
    np.testing.assert_allclose(normal_np[same], normal[same], rtol=1e-4, atol=1e-4 * np.abs(normal).max())


@pytest.mark.parametrize("name", ["box", "sphere"])
def test_no_ray_from_inside_slips_between_two_faces(name: str) -> None:
    mesh, rng = MESHES[name](), np.random.default_rng(5)
    origins = (rng.normal(size=(5000, 3)) * 0.1).astype(np.float32)
    directions = (_edge_points(mesh, 5000, rng) - origins).astype(np.float32)

    for tree in _trees(mesh):
        distance, face, _ = tree.first_hits(origins, directions)
        assert (face >= 0).all()
        np.testing.assert_allclose(distance, 1.0, atol=1e-5)


@pytest.mark.parametrize("name", sorted(MESHES))
def test_rays_away_from_the_mesh_hit_nothing(name: str) -> None:
    mesh, rng = MESHES[name](), np.random.default_rng(6)
    outward = rng.normal(size=(200, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    origins = (outward * 2.0 * np.linalg.norm(np.ptp(mesh.vertices_mm, axis=0))).astype(np.float32)

    for tree in _trees(mesh):
        _, face, normal = tree.first_hits(origins, outward.astype(np.float32))
        assert (face == -1).all()
        assert not normal.any()


def test_no_rays_have_no_hits() -> None:
    nothing = np.empty((0, 3), dtype=np.float32)

    distance, face, normal = _trees(MESHES["box"]())[1].first_hits(nothing, nothing)

    assert (distance.shape, face.shape, normal.shape) == ((0,), (0,), (0, 3))


def test_segments_without_embree_are_those_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    component = component_of(MESHES["stepped shaft"]())

    def labels() -> FloatArray:
        result = np.empty(len(component.mesh.faces))
        for segment in SdfSegmenter(SdfSegmenter.Settings()).segment(component, RunContext()):
            result[segment.faces] = segment.id
        return result

    with_embree = labels()
    monkeypatch.setattr(rays, "EMBREE", False)
    assert isinstance(RayScene(component.mesh.vertices_mm, component.mesh.faces)._tree, RayTree)
    without = labels()

    together = (with_embree[:, None] == with_embree) == (without[:, None] == without)
    assert together.mean() >= 0.99
