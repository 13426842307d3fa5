import numpy as np
import pytest

from gripwright.domain.shape import FloatArray
from gripwright.geometry import brep
from gripwright.geometry.projection import project


def extent(lines: tuple[FloatArray, ...]) -> FloatArray:
    points = np.concatenate(lines)
    return np.array([points.min(axis=0), points.max(axis=0)])


@pytest.mark.parametrize(
    ("toward", "right", "expected"),
    [
        ((0, -1, 0), (1, 0, 0), [[0, 0], [2, 5]]),
        ((-1, 0, 0), (0, -1, 0), [[-3, 0], [0, 5]]),
        ((0, 0, 1), (1, 0, 0), [[0, 0], [2, 3]]),
    ],
)
def test_a_view_has_the_extents_of_the_solid_along_right_and_up(toward, right, expected) -> None:
    view = project(brep.box((0, 0, 0), (2, 3, 5)), toward, right)

    assert extent(view.visible) == pytest.approx(np.array(expected, dtype=float), abs=1e-6)


def test_a_blind_hole_is_visible_from_its_side_and_hidden_from_the_other() -> None:
    block = brep.cut(brep.box((0, 0, 0), (20, 20, 10)), [brep.cylinder_z(10.0, 10.0, 3.0, 5.0, 11.0)])

    def shows_circle(lines: tuple[FloatArray, ...]) -> bool:
        return any(len(line) > 4 and np.allclose(np.linalg.norm(np.abs(line) - 10.0, axis=1), 3.0, atol=1e-6) for line in lines)

    above, below = project(block, (0, 0, 1), (1, 0, 0)), project(block, (0, 0, -1), (-1, 0, 0))
    assert shows_circle(above.visible)
    assert not shows_circle(below.visible)
    assert shows_circle(below.hidden)


def test_bores_are_listed_with_place_diameter_and_depth_and_pins_are_not() -> None:
    block = brep.cut(
        brep.box((0, 0, 0), (40, 20, 10)),
        [brep.cylinder_z(10.0, 10.0, 2.0, -1.0, 11.0), brep.cylinder_z(30.0, 5.0, 3.0, 4.0, 11.0)],
    )
    solid = brep.fuse(block, brep.cylinder_z(20.0, 10.0, 4.0, 9.0, 15.0))

    assert brep.bores_z(solid) == [(10.0, 10.0, 4.0, 0.0, 10.0), (30.0, 5.0, 6.0, 4.0, 10.0)]


def test_bores_are_the_same_after_storing() -> None:
    block = brep.cut(brep.box((0, 0, 0), (20, 20, 10)), [brep.cylinder_z(10.0, 10.0, 3.0, -1.0, 11.0)])

    assert brep.bores_z(brep.read_brep(brep.write_brep(block))) == brep.bores_z(block)
