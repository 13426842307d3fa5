"""What each gripper promises before it grasps anything: closed files, frames, openings."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from checker.fault import Fault, Limits
from checker.gripper import Gripper, finger_pose
from checker.shapes import Shape, placed

FRAME_TOLERANCE_MM = 0.01
ROUNDING_MM = 0.001
VOLUME_TOLERANCE = 0.01  # of the pad: curved surfaces are tessellated part by part
FILES = ("finger.step", "finger.stl", "finger.3mf", "body.stl", "gripper.glb")


def missing_files(folder: Path, record: dict[str, Any]) -> Iterator[Fault]:
    for name in FILES:
        if not (folder / "grippers" / record["id"] / name).is_file():
            yield Fault(record["id"], "", "files", f"{name} is missing")


def check_gripper(gripper: Gripper, limits: Limits) -> Iterator[Fault]:
    checks = (
        _closed_solids(gripper),
        _finger_frame(gripper),
        _bonded(gripper),
        _palm(gripper),
        _openings(gripper),
        _free_of_itself(gripper),
    )
    for details in checks:
        for promise, detail in details:
            yield Fault(gripper.id, "", promise, detail)
    for handle in gripper.record["handles"]:
        for detail in _handle_openings(gripper, handle, limits):
            yield Fault(gripper.id, handle["operation"], "opening-range", detail)


def check_jaw_offsets(grippers: list[Gripper]) -> Iterator[Fault]:
    """The actuator's own opening, which the jaw offset implies, is one number for one actuator."""
    openings: dict[tuple[str, str], float] = {}
    for gripper in grippers:
        actuator = gripper.record["actuator"]
        opening = gripper.record["opening_max"] - 2 * actuator["jaw_offset"]
        known = openings.setdefault((actuator["maker"], actuator["model"]), opening)
        if abs(opening - known) > 2 * ROUNDING_MM:
            yield Fault(
                gripper.id, "", "jaw-offset", f"implies an actuator opening of {opening:.3f} mm, elsewhere {known:.3f} mm"
            )


def _closed_solids(gripper: Gripper) -> Iterator[tuple[str, str]]:
    for name, mesh in (("finger.stl", gripper.finger), ("body.stl", gripper.body)):
        if not (mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0):
            yield "closed-solid", f"{name} is not a closed solid"


def _finger_frame(gripper: Gripper) -> Iterator[tuple[str, str]]:
    """Tip at z = 0; gripping surface on x = 0; stem and tip on the outer side of it."""
    tip = gripper.finger.bounds[1, 2]
    if abs(tip) > FRAME_TOLERANCE_MM:
        yield "finger-frame", f"the tip ends at z = {tip:.3f} mm, not at 0"
    stem = _slab(gripper.finger, -gripper.length_mm + FRAME_TOLERANCE_MM, 0.0)
    if len(stem) == 0:
        yield "finger-frame", "nothing of the finger lies within its length"
        return
    innermost = float((gripper.outward * stem[:, 0]).min())
    if abs(innermost) > FRAME_TOLERANCE_MM:
        yield "finger-frame", f"the gripping side of stem and tip is {innermost:.3f} mm from the plane x = 0"


def _bonded(gripper: Gripper) -> Iterator[tuple[str, str]]:
    """A finger and its pad fill the finger that touches, without meeting, and what touches is the pad."""
    if gripper.bonded is None:
        return
    bare, pad = gripper.bonded
    if not (bare.is_watertight and pad.is_watertight):
        yield "pad", "finger_bare.stl or pad.stl is not a closed solid"
        return
    whole, together = gripper.finger.volume, bare.volume + pad.volume
    if abs(together - whole) > VOLUME_TOLERANCE * pad.volume:
        yield "pad", f"finger and pad have {together:.1f} mm³ together, finger.stl {whole:.1f} mm³"
    meeting = trimesh.boolean.intersection([bare, pad])
    shared = meeting.volume if len(meeting.faces) else 0.0
    if shared > VOLUME_TOLERANCE * pad.volume:
        yield "pad", f"finger and pad share {shared:.1f} mm³"
    if (
        abs(float((gripper.outward * pad.vertices[:, 0]).min())) > FRAME_TOLERANCE_MM
        or abs(pad.bounds[1, 2]) > FRAME_TOLERANCE_MM
    ):
        yield "pad", "the pad does not reach the plane x = 0 at the tip"


def _palm(gripper: Gripper) -> Iterator[tuple[str, str]]:
    """At z = -L, and not before, begins what is not stem: a base, an offset arm or the body."""
    palm = -gripper.length_mm
    foremost = float(gripper.body.bounds[1, 2])
    if foremost > palm + FRAME_TOLERANCE_MM:
        yield "palm", f"the body reaches z = {foremost:.3f} mm, the palm is at {palm:.3f} mm"
    if foremost > palm - FRAME_TOLERANCE_MM:
        return
    stem, base = (_slab(gripper.finger, palm + low, palm + high)[:, :2] for low, high in ((0.02, 0.04), (-0.04, -0.02)))
    if len(stem) == 0 or len(base) == 0:
        yield "palm", f"the finger does not pass the palm at z = {palm:.3f} mm"
    elif (np.abs(stem.min(axis=0) - base.min(axis=0)) < 0.1).all() and (np.abs(stem.max(axis=0) - base.max(axis=0)) < 0.1).all():
        yield "palm", f"neither base nor body begins at z = {palm:.3f} mm"


def _slab(mesh: trimesh.Trimesh, low_mm: float, high_mm: float) -> Any:
    """Corners of the surface between two heights, (n, 3)."""
    vertices, faces = mesh.vertices, mesh.faces
    for normal, height in (([0, 0, 1], low_mm), ([0, 0, -1], high_mm)):
        if len(faces) == 0:
            break
        vertices, faces, _ = trimesh.intersections.slice_faces_plane(vertices, faces, normal, [0, 0, height])
    return vertices[np.unique(faces)]


def _openings(gripper: Gripper) -> Iterator[tuple[str, str]]:
    record = gripper.record
    low, high, stroke = record["opening_min"], record["opening_max"], record["actuator"]["stroke"]
    if high - low > stroke + ROUNDING_MM:
        yield "stroke", f"opens from {low:.3f} to {high:.3f} mm, the actuator's stroke is {stroke:.3f} mm"
    if low < 0 or high < low:
        yield "opening-range", f"{low:.3f} to {high:.3f} mm is no range"


def _handle_openings(gripper: Gripper, handle: dict[str, Any], limits: Limits) -> Iterator[str]:
    record = gripper.record
    low, high = record["opening_min"] - ROUNDING_MM, record["opening_max"] + ROUNDING_MM
    width, release = handle["opening_width"], handle["release_opening"]
    if not low <= width <= high:
        yield f"opening width {width:.3f} mm outside {low:.3f} to {high:.3f} mm"
    if gripper.outward * (release - width) < limits.release_clearance - ROUNDING_MM:
        yield f"release opening {release:.3f} mm for a width of {width:.3f} mm leaves less than {limits.release_clearance} mm"
    if not low <= release <= high:
        yield f"release opening {release:.3f} mm outside {low:.3f} to {high:.3f} mm"


def _free_of_itself(gripper: Gripper) -> Iterator[tuple[str, str]]:
    """Fingers meet neither each other nor the body; lying flush is allowed."""
    low, high = gripper.record["opening_min"], gripper.record["opening_max"]
    body = Shape([placed(gripper.body, _lifted(-FRAME_TOLERANCE_MM))])
    for opening in (low, (low + high) / 2, high):
        fingers = [
            Shape([placed(gripper.finger, finger_pose(angle, opening + 2 * FRAME_TOLERANCE_MM))]) for angle in gripper.angles_rad
        ]
        if any(_meet(one, other) for one, other in combinations(fingers, 2)):
            yield "fingers-meet", f"fingers run into each other at opening {opening:.3f} mm"
        if any(_meet(finger, body) for finger in fingers):
            yield "fingers-meet", f"a finger enters the body at opening {opening:.3f} mm"


def _meet(one: Shape, other: Shape) -> bool:
    return one.distance(other) == 0 or one.is_inside(other)


def _lifted(height_mm: float) -> Any:
    pose = np.eye(4)
    pose[2, 3] = height_mm
    return pose
