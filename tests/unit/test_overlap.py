"""A motion that overlaps by itself: how deep, where, and when."""

import numpy as np
import pytest

from gripwright.design.overlap import deepest_overlap
from gripwright.design.scenes import Body
from gripwright.domain.assembly import Component
from gripwright.domain.shape import FloatArray, Mesh
from mesh_factory import box_mesh, moved, turned_mesh


def at(x: float, y: float, z: float) -> FloatArray:
    X = np.eye(4)
    X[:3, 3] = x, y, z
    return X


def body(name: str, mesh: Mesh) -> Body:
    return Body(component=Component(id=name, mesh=mesh, X_PC=np.eye(4)), solid=mesh)


DOWN = np.stack([at(0, 0, 50), np.eye(4)])


@pytest.mark.parametrize("depth", [0.05, 0.4, 2.0])
def test_the_depth_of_an_overlap_is_found(depth: float) -> None:
    plate = body("plate", moved(box_mesh((40.0, 40.0, 10.0)), at(-20, -20, -10)))
    peg = body("peg", moved(turned_mesh(((0.0, 0.0), (5.0, 0.0), (5.0, 30.0), (0.0, 30.0)), 48), at(0, 0, -depth)))

    found = deepest_overlap(DOWN, [peg], [plate])

    assert found is not None
    assert found.depth_mm == pytest.approx(depth, rel=0.01)
    assert (found.active, found.passive, found.share) == ("peg", "plate", 1.0)
    assert found.place_P[2] == pytest.approx(-depth, abs=1e-6)


def test_what_only_touches_or_passes_by_does_not_overlap() -> None:
    plate = body("plate", moved(box_mesh((40.0, 40.0, 10.0)), at(-20, -20, -10)))
    beside = body("beside", moved(box_mesh((5.0, 5.0, 30.0)), at(20.01, 0, -10)))
    above = body("above", box_mesh((5.0, 5.0, 5.0)))

    assert deepest_overlap(DOWN, [beside, above], [plate]) is None


def test_an_overlap_on_the_way_alone_is_found_too() -> None:
    sheet = body("sheet", moved(box_mesh((40.0, 40.0, 6.0)), at(-20, -20, 22)))
    block = body("block", moved(box_mesh((6.0, 6.0, 6.0)), at(-3, -3, 0)))

    found = deepest_overlap(DOWN, [block], [sheet])

    assert found is not None
    assert 0.0 < found.share < 1.0
