"""Coarser segmentations: segments joined one by one."""

import numpy as np
import pytest

from gripwright.design.hierarchy import Join, joins
from gripwright.design.stages.prepare import PrepareSettings, prepare
from gripwright.domain.shape import Mesh, Segment
from gripwright.geometry.adjacency import connected_labels, face_adjacency
from gripwright.plugin_api import RunContext
from gripwright_builtin.segmenters.sdf import SdfSegmenter
from mesh_factory import SIX_STEPS, box_mesh, component_of, moved, plate_with_bosses, turned_mesh


def segmented(mesh: Mesh) -> tuple[Mesh, list[Segment]]:
    prepared = prepare(mesh, PrepareSettings(), RunContext()).mesh
    return prepared, list(SdfSegmenter(SdfSegmenter.Settings()).segment(component_of(prepared), RunContext()))


def leaves(join: Join, by_id: dict[int, Join]) -> set[int]:
    return {leaf for child in join.children for leaf in (leaves(by_id[child], by_id) if child in by_id else {child})}


@pytest.mark.parametrize("mesh", [turned_mesh(SIX_STEPS, 48), plate_with_bosses(32)], ids=["six steps", "plate"])
def test_joins_lead_in_nested_connected_steps_to_the_whole_body(mesh: Mesh) -> None:
    prepared, segments = segmented(mesh)
    adjacency = face_adjacency(prepared)

    made = joins(prepared, segments)

    by_id = {join.id: join for join in made}
    assert [join.id for join in made] == list(range(len(segments), 2 * len(segments) - 1))
    children = [child for join in made for child in join.children]
    assert len(children) == len(set(children))
    assert leaves(made[-1], by_id) == {item.id for item in segments}
    for join in made:
        faces = np.concatenate([segments[leaf].faces for leaf in leaves(join, by_id)])
        inside = np.isin(adjacency.pairs, faces).all(axis=1)
        assert len(np.unique(connected_labels(adjacency.pairs[inside], len(prepared.faces))[faces])) == 1
        assert join.area_mm2 == pytest.approx(sum(segments[leaf].area_mm2 for leaf in leaves(join, by_id)))


def test_the_border_of_a_join_is_the_outline_that_it_gives_up() -> None:
    prepared, segments = segmented(turned_mesh(SIX_STEPS, 256))
    radii = {
        segment.id: np.hypot(*prepared.vertices_mm[np.unique(prepared.faces[segment.faces]), :2].T).max() for segment in segments
    }

    first = joins(prepared, segments)[0]

    assert first.border_mm == pytest.approx(2.0 * np.pi * min(radii[child] for child in first.children), rel=2e-3)


def test_bodies_that_do_not_touch_are_not_joined() -> None:
    far = np.eye(4)
    far[0, 3] = 100.0
    one, other = box_mesh((10.0, 10.0, 10.0)), moved(box_mesh((10.0, 10.0, 10.0)), far)
    mesh = Mesh(
        vertices_mm=np.concatenate([one.vertices_mm, other.vertices_mm]), faces=np.concatenate([one.faces, other.faces + 8])
    )

    assert joins(*segmented(mesh)) == ()
