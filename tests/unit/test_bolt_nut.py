"""A public M16 bolt and nut: the nut comes down 74 mm, then follows its thread for eleven turns of 2 mm.

It is held across its flats of 24, the tips 3.25 below its top; two fingers 8 thick and 10 wide end at angles of 0° and 180°,
where they began.
"""

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from designed_products import COMPLETE, Designed, shared_package
from gripwright.cad.limits import DEFAULT_LIMITS
from gripwright.cad.package import read_package
from gripwright.design.finger_lengths import palm_hit
from gripwright.design.hand_check import HandCheck
from gripwright.design.motion import sampled
from gripwright.design.plan import plan_of
from gripwright.design.scenes import Body
from gripwright.domain.assembly import AssemblyTask, Obstacle
from gripwright.domain.grasp import EXTERNAL, PARALLEL_2, Grasp
from gripwright.domain.shape import FloatArray, Mesh
from gripwright.geometry.frames import pose
from gripwright.geometry.measures import volume_mm3
from gripwright_builtin.hands.parallel import ParallelHand
from gripwright_builtin.hands.prism import HandSettings
from mesh_factory import box_mesh, moved
from package_scenes import bodies_of, operation_of, scene_of

HAND = ParallelHand(HandSettings(thickness_mm=8.0, width_mm=10.0))
PITCH_MM, TURNS = 2.0, 11
NUT_TOP_MM, DEPTH_MM, ACROSS_FLATS_MM = 29.0 + 4.0, 3.25, 24.0  # the nut stands 4 higher in the product than in its file
TIPS_MM = NUT_TOP_MM - DEPTH_MM  # at the seat
LENGTH_MM, MARGIN_MM = 15.0, 0.1


@pytest.fixture(scope="module")
def package() -> Path:
    return shared_package("bolt-nut-m16")


@dataclass(frozen=True)
class Screwing:
    """The operation of the nut, with the components' repaired meshes."""

    task: AssemblyTask
    bodies: dict[str, Body]

    @property
    def motion(self) -> FloatArray:
        return operation_of(self.task, "nut-m16").motion

    def hit(self, *obstacles: Mesh, motion: FloatArray | None = None) -> str | None:
        """What the nut's gripper hits on the way, or None."""
        stands = tuple(Obstacle(id="obstacle", mesh=mesh, X_PE=np.eye(4)) for mesh in obstacles)
        operation = replace(operation_of(self.task, "nut-m16"), motion=self.motion if motion is None else motion)
        scene = scene_of(replace(self.task, obstacles=stands), operation, self.bodies, "nut-m16", plan_of({}))
        check = HandCheck(scene, HAND)
        down, x = np.array([0.0, 0.0, -1.0]), np.array([1.0, 0.0, 0.0])
        X_CG = pose(x, np.cross(down, x), down, np.array([0.0, 0.0, TIPS_MM - 4.0]))
        grasp = Grasp(X_CG=X_CG, gripper_type=PARALLEL_2, grip=EXTERNAL, opening_width_mm=ACROSS_FLATS_MM + 0.001)
        stems = check.seated(grasp, LENGTH_MM)
        return palm_hit(check, grasp, 31.5, LENGTH_MM) if stems is None else stems.detail


@pytest.fixture(scope="module")
def screwing(package: Path) -> Screwing:
    task = read_package(package, DEFAULT_LIMITS)
    return Screwing(task, bodies_of(task))


def post(angle_deg: float, low_mm: float, high_mm: float, radius_mm: float = 16.0) -> Mesh:
    """Half a millimetre thick, upright beside the bolt."""
    place = np.eye(4)
    place[:3, 3] = (
        radius_mm * np.cos(np.radians(angle_deg)) - 0.25,
        radius_mm * np.sin(np.radians(angle_deg)) - 0.25,
        low_mm,
    )
    return moved(box_mesh((0.5, 0.5, high_mm - low_mm)), place)


def test_the_motion_follows_the_thread_from_the_first_turn_to_the_last(screwing: Screwing) -> None:
    """Wherever it turns, it is as high above the seat as the pitch by the turns that are left."""
    way = screwing.motion
    poses = np.array(sampled(way, 2000))
    steps = np.linalg.inv(poses[:-1]) @ poses[1:]
    turns_rad = np.abs(np.arctan2(steps[:, 1, 0], steps[:, 0, 0]))
    left = np.append(np.cumsum(turns_rad[::-1])[::-1], 0.0) / (2.0 * np.pi)
    turning = poses[:, 2, 3] <= PITCH_MM * TURNS + 1e-6

    assert left[0] == pytest.approx(TURNS, abs=1e-6)
    assert poses[turning, 2, 3] == pytest.approx(PITCH_MM * left[turning], abs=1e-5)
    assert np.abs(poses[:, :2, 3]).max() < 1e-9


def test_the_nut_is_screwed_down_on_the_bolt_by_the_gripper_alone(screwing: Screwing) -> None:
    assert screwing.hit() is None


@pytest.mark.parametrize("angle_deg", [60.0, 90.0, 135.0, 270.0])
def test_a_post_that_only_the_turning_fingers_reach_is_found(screwing: Screwing, angle_deg: float) -> None:
    """It stands half-way up the thread, beside where the fingers begin and end: a straight motion passes it."""
    way = screwing.motion
    standing = post(angle_deg, TIPS_MM + 8.0, TIPS_MM + 11.0)

    assert screwing.hit(standing) is not None
    assert screwing.hit(standing, motion=way[[0, -1]]) is None


@pytest.mark.parametrize("angle_deg", [70.0, 90.0, 110.0])
def test_the_turning_fingers_reach_down_as_far_as_the_helix_and_no_farther(screwing: Screwing, angle_deg: float) -> None:
    """At an angle φ before the end the tips are φ·pitch/360° above their seat, less what half a finger's width is ahead.

    The thread is right-handed: seen from above the nut turns clockwise, to its end from greater angles.
    """
    ahead_deg = np.degrees(np.arcsin(5.0 / 16.0))
    lowest_mm = TIPS_MM + PITCH_MM * (angle_deg - ahead_deg) / 360.0

    assert screwing.hit(post(angle_deg, TIPS_MM - 5.0, lowest_mm - MARGIN_MM - 0.08)) is None
    assert screwing.hit(post(angle_deg, TIPS_MM - 5.0, lowest_mm + 0.02)) is not None


def test_the_nuts_mesh_is_closed_before_it_is_used(screwing: Screwing) -> None:
    """The file has cracks where corners lie on others' edges: every edge is shared by two faces afterwards, the volume stays."""
    raw, solid = screwing.task.component("nut-m16").mesh, screwing.bodies["nut-m16"].solid

    assert open_edges(raw) > 0
    assert open_edges(solid) == 0
    assert volume_mm3(solid) == pytest.approx(volume_mm3(raw), rel=1e-3)


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_the_nut_is_designed_for_across_its_flats_as_a_screw(package: Path, designed: Designed) -> None:
    code, folder = designed(package)
    document: dict[str, Any] = json.loads((folder / "design.json").read_text())
    operation = next(entry for entry in document["operations"] if entry["id"] == "op-02")
    handles = [handle for gripper in document["grippers"] for handle in gripper["handles"] if handle["operation"] == "op-02"]

    assert code == COMPLETE
    assert (operation["kind"], operation["status"]) == ("screwing", "covered")
    assert operation["evidence"]["pitch"] == pytest.approx(PITCH_MM, abs=1e-6)
    assert [handle["opening_width"] for handle in handles] == pytest.approx([ACROSS_FLATS_MM], abs=0.05)


def open_edges(mesh: Mesh) -> int:
    """How many edges do not belong to two faces, corners at one place being one."""
    _, index = np.unique(np.round(mesh.vertices_mm, 5), axis=0, return_inverse=True)
    faces = index.reshape(-1)[mesh.faces]
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    edges = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    return int((counts != 2).sum())
