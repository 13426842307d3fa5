"""The judge finds nothing in a sound design, and every planted fault in a spoilt one."""

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

from checker.bench import Bench, box, finger, from_above, shifted, sound_bench, tube, turned
from checker.promises import check_design

Spoil = Callable[[Bench], object]


def judged(bench: Bench, folder: Path) -> set[str]:
    """Promises broken, each as `gripper operation: promise`."""
    return {f"{fault.gripper} {fault.operation}: {fault.promise}".strip() for fault in check_design(*bench.write(folder))}


def test_a_sound_design_has_no_fault(tmp_path: Path) -> None:
    assert check_design(*sound_bench().write(tmp_path)) == []


def test_a_zipped_package_in_metres_is_judged_alike(tmp_path: Path) -> None:
    bench = sound_bench()
    for entry in bench.product["components"] + bench.product["environment"]:
        entry["units"] = "m"
    for mesh in bench.parts.values():
        mesh.apply_scale(0.001)
    design, package = bench.write(tmp_path)
    assert check_design(design, Path(shutil.make_archive(str(tmp_path / "package"), "zip", package))) == []


def test_an_open_mesh_is_judged_alike(tmp_path: Path) -> None:
    bench = sound_bench()
    bench.parts["plate"] = opened(bench.parts["plate"])
    assert check_design(*bench.write(tmp_path)) == []


def opened(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.faces[1:], process=False)


def moved_finger(x: float, y: float, z: float) -> Spoil:
    return lambda bench: bench.fingers["G1"].apply_translation([x, y, z])


def tilted_finger(bench: Bench) -> None:
    bench.fingers["G1"].apply_transform(trimesh.transformations.rotation_matrix(np.radians(6), [0, 1, 0]))


def changed_handle(name: str, **values: object) -> Spoil:
    return lambda bench: bench.handle(name).update(values)


def changed_gripper(name: str, **values: object) -> Spoil:
    return lambda bench: bench.gripper(name).update(values)


def turned_pose(degrees: float) -> Spoil:
    return changed_handle("G1", grasp_pose=(turned(np.radians(degrees)) @ from_above(7.0)).tolist())


def turned_and_opened(bench: Bench) -> None:
    turned_pose(8.0)(bench)
    bench.handle("G1").update(opening_width=21.19)


def cut_finger(bench: Bench) -> None:
    bench.fingers["G1"] = finger(15.0, 6.0, 14.0, 5.0)


def obstacle(mesh: trimesh.Trimesh) -> Spoil:
    return lambda bench: bench.put_in_the_way(mesh)


def raised_body(bench: Bench) -> None:
    bench.bodies["G1"].apply_translation([0, 0, 6])


def weak_stroke(bench: Bench) -> None:
    bench.gripper("G1")["actuator"]["stroke"] = 15.0


def wider_ban(bench: Bench) -> None:
    bench.component("block")["no_grasp"][0]["box"]["max"][2] = 9


def open_finger(bench: Bench) -> None:
    bench.fingers["G1"] = opened(bench.fingers["G1"])


def open_housing(bench: Bench) -> None:
    bench.put_in_the_way(opened(box([-300, -300, -300], [300, 300, 300])))


def forgotten_handle(bench: Bench) -> None:
    bench.gripper("G1")["handles"].clear()


def second_handle(bench: Bench) -> None:
    bench.gripper("G1")["handles"].append(bench.handle("G1"))


def shared_actuator(bench: Bench) -> None:
    bench.gripper("G2")["actuator"]["model"] = bench.gripper("G1")["actuator"]["model"]


def low_contact(bench: Bench) -> None:
    bench.handle("G1").update(grasp_pose=from_above(9.5).tolist(), gap=9.5)


def companion_inside_a_finger(bench: Bench) -> None:
    bench.parts["bead"] = box([12, -1, 12], [14, 1, 14])
    bench.product["components"].append(bench.component("block") | {"id": "bead", "file": "bead.stl", "no_grasp": []})
    bench.design["components"].append({"id": "bead", "status": "covered", "segments": []})
    bench.operation("op-01").update(active=["block", "bead"], grasp="block")


def capped_pin(bench: Bench) -> None:
    """A head over the fingers' way out, as wide as the fingers once they let go."""
    bench.parts["pin"] = trimesh.boolean.union([tube(6.0, 0.0, 24.0), tube(6.45, 20.5, 22.0)])


def moved_pad(x: float, y: float, z: float) -> Spoil:
    return lambda bench: bench.bonded["G1"][1].apply_translation([x, y, z])


def finger_without_a_seat(bench: Bench) -> None:
    bench.bonded["G1"][0] = bench.fingers["G1"]


PLANTED: dict[str, tuple[Spoil, str]] = {
    "finger moved inwards": (moved_finger(-0.2, 0, 0), "G1 : finger-frame"),
    "finger moved outwards": (moved_finger(0.2, 0, 0), "G1 op-01: touch"),
    "finger moved along z": (moved_finger(0, 0, 0.1), "G1 : finger-frame"),
    "finger tilted": (tilted_finger, "G1 op-01: touch"),
    "finger cut": (cut_finger, "G1 : palm"),
    "finger open": (open_finger, "G1 : closed-solid"),
    "pad in the finger": (moved_pad(0.2, 0, 0), "G1 : pad"),
    "pad short of the tip": (moved_pad(0, 0, -0.1), "G1 : pad"),
    "no seat for the pad": (finger_without_a_seat, "G1 : pad"),
    "body too near": (raised_body, "G1 : palm"),
    "body in the fingers": (raised_body, "G1 : fingers-meet"),
    "width 1 mm too large": (changed_handle("G1", opening_width=21.0, release_opening=22.0), "G1 op-01: touch"),
    "width 1 mm too small": (changed_handle("G1", opening_width=19.0), "G1 op-01: enter"),
    "width 1 mm too small from inside": (changed_handle("G3", opening_width=29.0, release_opening=28.0), "G3 op-03: touch"),
    "width 1 mm too large from inside": (changed_handle("G3", opening_width=31.0), "G3 op-03: enter"),
    "pose turned": (turned_pose(8.0), "G1 op-01: enter"),
    "pose turned, opened until free": (
        turned_and_opened,
        "G1 op-01: touch",
    ),
    "contact too low": (low_contact, "G1 op-01: touch"),
    "another active component inside a finger": (companion_inside_a_finger, "G1 op-01: enter"),
    "obstacle at the end": (obstacle(box([16.05, -5, 6], [20, 5, 20])), "G1 op-01: clear"),
    "obstacle on the way, thinner than a step": (obstacle(box([15.9, -5, 60], [16, 5, 60.01])), "G1 op-01: clear"),
    "obstacle at the screw's side": (obstacle(box([37, 10, 70], [39, 10.5, 75])), "G2 op-02: clear"),
    "obstacle around everything": (obstacle(box([-300, -300, -300], [300, 300, 300])), "G1 op-01: clear"),
    "open obstacle around everything": (open_housing, "G1 op-01: clear"),
    "obstacle inside the body": (obstacle(box([-2, -2, 60], [2, 2, 62])), "G1 op-01: clear"),
    "head over the opened fingers": (capped_pin, "G2 op-02: leave"),
    "release below the clearance": (changed_handle("G1", release_opening=20.5), "G1 op-01: opening-range"),
    "release beyond the range": (changed_handle("G1", release_opening=25.0), "G1 op-01: opening-range"),
    "release opens from inside": (changed_handle("G3", release_opening=31.0), "G3 op-03: opening-range"),
    "stroke exceeded": (weak_stroke, "G1 : stroke"),
    "fingers meet when closed": (changed_gripper("G2", opening_min=0.0), "G2 : fingers-meet"),
    "jaw offset at odds": (shared_actuator, "G2 : jaw-offset"),
    "gap overstated": (changed_handle("G1", gap=7.5), "G1 op-01: gap"),
    "gap withheld": (changed_handle("G1", gap=None), "G1 op-01: gap"),
    "no_grasp touched": (wider_ban, "G1 op-01: no-grasp"),
    "operation without a handle": (forgotten_handle, "op-01: coverage"),
    "operation with two handles": (second_handle, "op-01: coverage"),
    "wrong component": (changed_handle("G1", component="pin"), "G1 op-01: coverage"),
    "finger shorter than the segment needs": (changed_gripper("G2", finger_length=4.0), "G2 op-02: coverage"),
}


@pytest.mark.parametrize(("spoil", "broken"), PLANTED.values(), ids=PLANTED.keys())
def test_a_planted_fault_is_found(spoil: Spoil, broken: str, tmp_path: Path) -> None:
    bench = sound_bench()
    spoil(bench)
    assert broken in judged(bench, tmp_path)


@pytest.mark.parametrize(("low_mm", "broken"), [(20, "G1 op-01: leave"), (115, "G1 op-01: take-up")])
def test_an_obstacle_beside_the_open_hand_hinders_nothing_but_letting_go(low_mm: float, broken: str, tmp_path: Path) -> None:
    bench = sound_bench()
    bench.put_in_the_way(box([-28, -5, low_mm], [-24.3, 5, low_mm + 40]))
    assert {broken} <= judged(bench, tmp_path) <= {"G1 op-01: leave", "G1 op-01: take-up"}


def test_an_obstacle_outside_all_motions_breaks_nothing(tmp_path: Path) -> None:
    bench = sound_bench()
    bench.put_in_the_way(box([-28, -5, 20], [-24.7, 5, 60]))
    assert judged(bench, tmp_path) == set()


def test_without_release_clearance_leaving_is_not_promised(tmp_path: Path) -> None:
    bench = sound_bench()
    for name, width in (("G1", 20.0), ("G2", 12.0), ("G3", 30.0)):
        bench.handle(name)["release_opening"] = width
    assert check_design(*bench.write(tmp_path), release_clearance=0.0) == []


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    design, package = sound_bench().write(tmp_path)
    (design / "grippers" / "G2" / "gripper.glb").unlink()
    assert [fault.detail for fault in check_design(design, package)] == ["gripper.glb is missing"]


def test_shifted_products_are_judged_alike(tmp_path: Path) -> None:
    """Poses compose: moving everything changes nothing."""
    bench = sound_bench()
    move = shifted(500, -300, 200) @ turned(0.7)
    for entry in bench.product["components"] + bench.product["environment"]:
        entry["pose"] = (move @ np.array(entry["pose"])).tolist()
    for operation in bench.product["operations"]:
        for key in ("pose_before", "pose_after"):
            operation[key] = (move @ np.array(operation[key]) @ np.linalg.inv(move)).tolist()
        operation["waypoints"] = [(move @ np.array(pose) @ np.linalg.inv(move)).tolist() for pose in operation["waypoints"]]
    assert check_design(*bench.write(tmp_path)) == []
