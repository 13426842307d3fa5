"""The bill of materials: one row a bought or made item of each gripper, with part numbers that depend on content alone."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from gripwright.domain.assembly import AssemblyTask
from gripwright.domain.grasp import SURFACE
from gripwright.domain.gripper import BondedFinger, BoughtPart, FingerDesign, Gripper
from gripwright.domain.shape import Mesh
from gripwright.domain.v_tip import tip_words

BUY, MAKE, ASSEMBLE, OWNED = "buy", "make", "assemble", "owned"

_MADE_FILES = (".step", ".stl", ".3mf")
_BODY_FILES = ("body.step", "body.stl")

_SCREWS_A_FINGER = 2
_SCREW_DEFAULT_MM = (4.0, 16.0)  # thread and length where the finger does not state its base
_SCREW_LENGTHS_MM = (6, 8, 10, 12, 16, 20, 25, 30, 35, 40, 45, 50, 55, 60, 70, 80)
_ENGAGEMENT = 1.2  # least length of thread in the jaw, in diameters
_HEAD_CLEARANCE_MM = 0.5  # how far a head, as high as the thread is thick, is sunk below the surface
_PIN_LENGTH_MM = 10.0
_MESH_GRID_MM = 1e-3  # vertices are rounded to it before they are hashed


@dataclass(frozen=True, slots=True, kw_only=True)
class BomRow:
    """One item of one gripper. `mass_kg` is of one piece; None: not known."""

    gripper: str
    item: str
    make_or_buy: str
    maker: str
    model: str
    part_number: str
    quantity: int
    description: str
    material: str = ""
    mass_kg: float | None = None
    operations: tuple[str, ...] = ()
    files: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """JSON values, in the order of the columns."""
        return {
            field.name: list(value) if isinstance(value := getattr(self, field.name), tuple) else value for field in fields(self)
        }


COLUMNS = tuple(field.name for field in fields(BomRow))


def bom(
    task: AssemblyTask, grippers: Sequence[Gripper], fingers: Mapping[str, FingerDesign], owned: Mapping[str, str]
) -> list[BomRow]:
    """All rows, gripper by gripper; `fingers` by gripper id. A gripper without finger has its actuator alone.

    `owned` has the names of grippers that are at hand, by gripper id: one row each, with nothing to buy or make.
    Operations stand in the order of the assembly sequence.
    """
    sequence = {operation.id: i for i, operation in enumerate(task.operations)}
    rows: list[BomRow] = []
    for gripper in grippers:
        operations = tuple(sorted((handle.operation for handle in gripper.handles), key=lambda op: sequence[op]))
        if gripper.id in owned:
            rows.append(_owned_row(gripper, owned[gripper.id], operations))
            continue
        rows.append(_actuator_row(gripper, operations, made=gripper.id in fingers))
        if gripper.id in fingers:
            parts = _finger_rows(gripper, fingers[gripper.id], operations)
            rows.extend(replace(part, operations=operations) for part in parts)
    return rows


def finger_part_number(finger: FingerDesign) -> str:
    """A number that depends on the shape and material of the finger, without its pad, alone."""
    return _content_number("F", finger.mesh if finger.bonded is None else finger.bonded.bare.mesh, finger.material)


def pad_part_number(bonded: BondedFinger) -> str:
    """A number that depends on the pad's shape and material alone; of a bought part its designation."""
    if bonded.bought is not None:
        return bonded.bought.designation
    return _content_number("P", bonded.pad.mesh, bonded.pad.material)


def _content_number(kind: str, mesh: Mesh, material: str) -> str:
    vertices = np.round(mesh.vertices_mm / _MESH_GRID_MM).astype(np.int64)  # (n, 3)
    triangles = vertices[mesh.faces].reshape(-1, 9)
    ordered = triangles[np.lexsort(triangles.T[::-1])]  # whatever the order of the faces
    return part_number(kind, material.encode() + ordered.tobytes())


def _actuator_row(gripper: Gripper, operations: tuple[str, ...], *, made: bool) -> BomRow:
    actuator = gripper.actuator
    return BomRow(
        gripper=gripper.id,
        item="actuator",
        make_or_buy=BUY,
        maker=actuator.maker,
        model=actuator.model,
        part_number=actuator.model,
        quantity=1,
        description=f"{gripper.gripper_type} gripper actuator"
        + (f", stroke {actuator.stroke_mm:g} mm" if actuator.closes else ""),
        mass_kg=actuator.mass_kg,
        operations=operations,
        files=tuple(f"grippers/{gripper.id}/{name}" for name in _BODY_FILES) if made else (),
    )


def _owned_row(gripper: Gripper, name: str, operations: tuple[str, ...]) -> BomRow:
    return BomRow(
        gripper=gripper.id,
        item="gripper",
        make_or_buy=OWNED,
        maker=gripper.actuator.maker,
        model=gripper.actuator.model,
        part_number=name,
        quantity=1,
        description=f"{gripper.gripper_type} gripper at hand, fingers {gripper.finger_length_mm:g} mm{_tips(gripper)}",
        operations=operations,
    )


def _finger_rows(gripper: Gripper, finger: FingerDesign, operations: tuple[str, ...]) -> list[BomRow]:
    bare_kg, name = (finger.mass_kg, "finger") if finger.bonded is None else (finger.bonded.bare.mass_kg, "finger_bare")
    range_mm = f"openings {gripper.opening_min_mm:.4g} to {gripper.opening_max_mm:.4g} mm"
    made = BomRow(
        gripper=gripper.id,
        item=finger.name,
        make_or_buy=MAKE,
        maker="",
        model="",
        part_number=finger_part_number(finger),
        quantity=gripper.fingers,
        description=f"{finger.name} {gripper.finger_length_mm:g} mm{_tips(gripper)} for "
        f"{f'⌀{gripper.opening_max_mm:.4g} mm' if gripper.grip == SURFACE else range_mm} on {gripper.actuator.name}",
        material=finger.material,
        mass_kg=round(bare_kg, 6),
        operations=operations,
        files=(*(f"grippers/{gripper.id}/{name}{suffix}" for suffix in _MADE_FILES), f"grippers/{gripper.id}/finger.svg"),
    )
    thread_mm, length_mm = _screw(finger.properties)
    pads = [] if finger.bonded is None else [_pad_row(gripper, finger.bonded, operations)]
    if finger.bought is not None:
        return [made, *pads, *(_bought_row(gripper, part) for part in finger.bought)]
    rows = [
        made,
        *pads,
        _standard_row(gripper, "screw", f"ISO 4762 M{thread_mm:g}x{length_mm:g}-8.8", "steel 8.8", _SCREWS_A_FINGER),
    ]
    pin_mm = finger.properties.get("pin_hole_mm", 0.0)
    if pin_mm > 0.0:
        rows.append(_standard_row(gripper, "pin", f"ISO 8734 {pin_mm:g}x{_PIN_LENGTH_MM:g}-A", "steel, hardened", 1))
    return rows


def _tips(gripper: Gripper) -> str:
    words = tip_words(gripper.taper_rad, gripper.vee)
    return f", {words}" if words else ""


def _bought_row(gripper: Gripper, part: BoughtPart) -> BomRow:
    return BomRow(
        gripper=gripper.id,
        item=part.item,
        make_or_buy=BUY,
        maker="",
        model=part.designation,
        part_number=part.designation,
        quantity=part.quantity * gripper.fingers,
        description=part.description,
        material=part.material,
        mass_kg=part.mass_kg,
    )


def _pad_row(gripper: Gripper, bonded: BondedFinger, operations: tuple[str, ...]) -> BomRow:
    if bonded.bought is not None:
        return replace(_bought_row(gripper, bonded.bought), files=_pad_files(gripper))
    size = " x ".join(f"{side:.4g}" for side in bonded.pad_size_mm)
    return BomRow(
        gripper=gripper.id,
        item="pad",
        make_or_buy=MAKE,
        maker="",
        model="",
        part_number=pad_part_number(bonded),
        quantity=gripper.fingers,
        description=f"pad {size} mm, bond to the finger over its whole face with {bonded.adhesive}",
        material=bonded.pad.material,
        mass_kg=round(bonded.pad.mass_kg, 6),
        operations=operations,
        files=_pad_files(gripper),
    )


def _pad_files(gripper: Gripper) -> tuple[str, ...]:
    return tuple(f"grippers/{gripper.id}/pad.{suffix}" for suffix in ("step", "stl"))


def _screw(properties: Mapping[str, float]) -> tuple[float, float]:
    """Thread and length of the screws that hold a finger of those properties to its jaw."""
    if "bolt_thread_mm" not in properties or "base_thickness_mm" not in properties:
        return _SCREW_DEFAULT_MM
    thread_mm = properties["bolt_thread_mm"]
    clamped_mm = properties["base_thickness_mm"] - thread_mm - _HEAD_CLEARANCE_MM
    needed_mm = clamped_mm + _ENGAGEMENT * thread_mm
    return thread_mm, next((length for length in _SCREW_LENGTHS_MM if length >= needed_mm), _SCREW_LENGTHS_MM[-1])


def _standard_row(gripper: Gripper, item: str, designation: str, material: str, a_finger: int) -> BomRow:
    names = {"screw": "hexagon socket head cap screw", "pin": "parallel pin"}
    return BomRow(
        gripper=gripper.id,
        item=item,
        make_or_buy=BUY,
        maker="",
        model=designation,
        part_number=designation,
        quantity=a_finger * gripper.fingers,
        description=f"{names[item]}, finger to jaw",
        material=material,
    )


def part_number(kind: str, content: bytes | str) -> str:
    """A number that depends on content alone."""
    digest = hashlib.sha256(content.encode() if isinstance(content, str) else content).hexdigest()
    return f"GW-{kind}-{digest[:10].upper()}"
