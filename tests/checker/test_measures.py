"""The judge's own measures against shapes whose answer is known."""

import numpy as np
import pytest
import trimesh

from checker.bench import box, shifted, tube, turned
from checker.contact import contact_height
from checker.motion import Screw, nearest_approach
from checker.shapes import Shape, placed, winding_numbers

PAD = box([0, -5, -20], [6, 5, 0])  # a finger whose gripping surface is the plane x = 0, facing -x


def test_the_nearest_approach_of_a_straight_motion_is_found_between_its_ends() -> None:
    ball = Shape([trimesh.creation.icosphere(subdivisions=3, radius=5.0).apply_translation([-60, 0, 0])])
    needle = Shape([box([-0.01, 6, -0.01], [0.01, 20, 0.01])])
    nearest = nearest_approach(ball, needle, [Screw.straight(np.array([120.0, 0, 0]))], 0.1, 0.02)
    assert nearest.distance_mm == pytest.approx(1.0, rel=0.02)
    assert nearest.progress == pytest.approx(0.5, abs=0.01)


def test_a_screw_carries_a_point_along_its_helix() -> None:
    end = shifted(0, 0, 10) @ turned(np.pi / 2)
    halfway = Screw.between(np.eye(4), end).displacement(0.5) @ [1, 0, 0, 1]
    assert halfway[:3] == pytest.approx([np.sqrt(0.5), np.sqrt(0.5), 5.0])


@pytest.mark.parametrize(("part", "inside"), [(box([-1, -1, -1], [1, 1, 1]), True), (box([9, 9, 9], [11, 11, 11]), False)])
def test_what_stands_in_a_hollow_is_inside_only_if_the_wall_holds_it(part: trimesh.Trimesh, inside: bool) -> None:
    """A closed hull holds what is in it; a hull with a cavity around the part does not."""
    hull = box([-5, -5, -5], [5, 5, 5])
    hollow = trimesh.boolean.difference([hull, box([-3, -3, -3], [3, 3, 3])])
    assert Shape([part]).is_inside(Shape([hull])) == inside
    assert not Shape([part]).is_inside(Shape([hollow]))


def test_a_point_in_an_open_box_is_more_inside_than_outside() -> None:
    mesh = box([-5, -5, -5], [5, 5, 5])
    mesh.update_faces(np.arange(len(mesh.faces)) > 0)
    numbers = winding_numbers(np.array([[0.0, 0, 0], [20, 0, 0]]), mesh)
    assert numbers[0] > 0.8
    assert abs(numbers[1]) < 0.1


@pytest.mark.parametrize(
    ("degrees", "touches"), [(0.0, True), (4.0, True), (6.0, False), (45.0, False)], ids=["flat", "4", "6", "edge"]
)
def test_surfaces_touch_within_five_degrees_of_parallel(degrees: float, touches: bool) -> None:
    block = box([-10, -10, -8], [10, 10, 12])
    block.apply_transform(turned(np.radians(degrees)))
    block.apply_translation([-block.bounds[1, 0] - 0.001, 0, 0])
    corner = block.vertices[np.argmax(block.vertices[:, 0])]
    block.apply_translation([0, -corner[1] if degrees else 0.0, 0])
    assert contact_height(PAD, block, -1.0) == pytest.approx(8.0 if touches else 0.0, abs=0.15)


@pytest.mark.parametrize(("gap_mm", "height_mm"), [(0.0, 6.0), (0.045, 6.0), (0.055, 0.0)])
def test_a_gap_above_a_twentieth_of_a_millimetre_is_no_touch(gap_mm: float, height_mm: float) -> None:
    rod = placed(tube(8.0, -6.0, 5.0), shifted(-8.0 - gap_mm, 0, 0))
    assert contact_height(PAD, rod, -1.0) == pytest.approx(height_mm, abs=0.15)
