"""product.json: the model of a product package's document. Imports no mesh library."""

from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import PurePosixPath
from typing import Annotated, Any, Literal, cast

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic_core import PydanticCustomError

from gripwright.cad.document import checked_entries, faults_of, parse_json, pointer, refuse
from gripwright.cad.formats import EXTENSIONS, STATES_UNITS, format_of
from gripwright.cad.limits import DEFAULT_LIMITS, Limits
from gripwright.cad.sequence import duplicate_faults, entries, sequence_faults, string_of
from gripwright.domain.assembly import Texture
from gripwright.domain.errors import Fault
from gripwright.domain.shape import FloatArray

ROTATION_TOLERANCE = 1e-4  # of RᵀR from the identity: a pose written with five digits is meant as the nearest rotation
LAST_ROW_TOLERANCE = 1e-9
MAX_TRANSLATION_MM = 1e6
MAX_COMPONENTS, MAX_OPERATIONS, MAX_WAYPOINTS, MAX_REGIONS = 5000, 20_000, 10_000, 1000
HALF_TURN_RAD = np.pi - 1e-6

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Row = tuple[Number, Number, Number, Number]
Point = tuple[Number, Number, Number]
Rows = tuple[Row, Row, Row, Row]


def _check_id(value: str) -> str:
    if value in {".", ".."} or value != value.strip() or not value.isprintable() or set(value) & set("/\\"):
        raise PydanticCustomError("id", "not an id: control characters, slashes and blanks around it are not allowed")
    return value


def _check_line(value: str) -> str:
    if not value.isprintable():
        raise PydanticCustomError("line", "one line of text without control characters is needed")
    return value


def _check_part_number(value: str) -> str:
    if not value.strip():
        raise PydanticCustomError("blank", "must not be blank")
    return value


def _check_note(value: str) -> str:
    _check_line(value.replace("\n", " ").replace("\r", " ").replace("\t", " "))
    return value


def _nearest_rigid(rows: Rows) -> Rows:
    """The pose itself, or for one whose numbers were rounded, the pose of the nearest rotation."""
    X = np.array(rows)
    R = X[:3, :3]
    deviation = float(np.abs(R.T @ R - np.eye(3)).max())
    determinant = float(np.linalg.det(R))
    if deviation > ROTATION_TOLERANCE or determinant < 0:
        message = (
            f"not a rigid pose: the rotation's determinant is {determinant:.6g}, must be 1; "
            f"RᵀR deviates from the identity by {deviation:.3g}, at most {ROTATION_TOLERANCE:g}"
        )
        raise PydanticCustomError("rigid", "{message}", {"message": message})
    if np.abs(X[3] - [0, 0, 0, 1]).max() > LAST_ROW_TOLERANCE:
        raise PydanticCustomError("rigid", "not a rigid pose: the last row must be 0 0 0 1")
    if np.abs(X[:3, 3]).max() > MAX_TRANSLATION_MM:
        raise PydanticCustomError("rigid", "translation of more than {limit} mm", {"limit": f"{MAX_TRANSLATION_MM:.0f}"})
    if deviation > 1e-9:
        U, _, Vt = np.linalg.svd(R)
        X[:3, :3] = U @ Vt
    return cast(Rows, tuple(tuple(row) for row in X.tolist()))


def check_file_name(name: str) -> str:
    """A relative path inside the package, with / between folders; PydanticCustomError otherwise."""
    path = PurePosixPath(name)
    if path.is_absolute() or ".." in path.parts or "\\" in name or ":" in name or not name.isprintable():
        raise PydanticCustomError("file_name", "the path must stay inside the package: relative, with / and without ..")
    if format_of(name) is None:
        raise PydanticCustomError("file_name", "not a format that is read, which are {known}", {"known": " ".join(EXTENSIONS)})
    return str(path)


Line = Annotated[str, Field(max_length=500), AfterValidator(_check_line)]
Note = Annotated[str, Field(max_length=10_000), AfterValidator(_check_note)]
Id = Annotated[str, Field(min_length=1, max_length=200), AfterValidator(_check_id)]
Pose = Annotated[Rows, AfterValidator(_nearest_rigid)]
SystemName = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]
ExternalId = Annotated[str, Field(min_length=1, max_length=200), AfterValidator(_check_line), AfterValidator(_check_part_number)]
ExternalIds = Annotated[
    dict[SystemName, ExternalId], Field(max_length=20, description="name of another system → the id that it has there")
]
Names = Annotated[tuple[str, ...], Field(max_length=MAX_COMPONENTS, fail_fast=True)]
FileName = Annotated[str, Field(min_length=1, max_length=500), AfterValidator(check_file_name)]

IDENTITY_POSE: Rows = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))


class _Entry(BaseModel):
    """Strict: unknown fields are faults, so that a misspelt one is not lost; `note` is free text for people."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    note: Note = ""


class BoxEntry(BaseModel):
    """An axis-aligned box in the component's frame, mm, closed."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    min: Point
    max: Point

    @model_validator(mode="after")
    def _ordered(self) -> "BoxEntry":
        if any(low > high for low, high in zip(self.min, self.max, strict=True)):
            raise PydanticCustomError("box", "min exceeds max")
        return self


class RegionEntry(_Entry):
    """A region of a component: a box, or segments of an earlier analysis."""

    reason: Line = "marked"
    box: BoxEntry | None = None
    segments: Annotated[tuple[Annotated[int, Field(strict=True, ge=0, lt=2**53)], ...], Field(fail_fast=True)] = ()

    @model_validator(mode="after")
    def _one_form(self) -> "RegionEntry":
        if (self.box is None) == (not self.segments):
            raise PydanticCustomError("region", "exactly one of box and segments must be given")
        return self


Regions = Annotated[tuple[RegionEntry, ...], Field(max_length=MAX_REGIONS, fail_fast=True)]


class _FileEntry(_Entry):
    """What has an id, a CAD file and a pose."""

    id: Id
    file: FileName
    units: Literal["mm", "cm", "m", "in"] | None = Field(default=None, validate_default=True)
    pose: Pose = IDENTITY_POSE

    @field_validator("units")
    @classmethod
    def _stated(cls, units: str | None, info: ValidationInfo) -> str | None:
        file = info.data.get("file")
        if units is None and file is not None and format_of(file) not in STATES_UNITS:
            raise PydanticCustomError("units", "units absent: {file} does not carry them; mm, cm, m or in", {"file": file})
        return units


class ComponentEntry(_FileEntry):
    """A component of the product."""

    part_number: Line = ""
    revision: Line = ""
    name: Line = ""
    density: Annotated[Number, Field(gt=0, le=25_000, description="kg/m³")] = 7850.0
    friction: Annotated[Number, Field(gt=0, le=5, description="coefficient of friction")] = 0.2
    texture: Texture | None = Field(None, description="how tight its surface is against a suction cup's lip; null: not known")
    ferrous: Annotated[bool, Field(strict=True)] | None = Field(None, description="whether a magnet holds it; null: not known")
    no_grasp: Regions = ()
    may_grasp: Regions = ()
    external_ids: ExternalIds = {}


class ObstacleEntry(_FileEntry):
    """A fixture or support; `operations` None: it stands around in all of them."""

    operations: Annotated[tuple[str, ...], Field(max_length=MAX_OPERATIONS, fail_fast=True)] | None = None


class OperationEntry(_Entry):
    """The paper's ⟨c_a, c_p, ᵃT_p, ᵃ'T_p⟩; poses displace the active subassembly from its place in the product frame."""

    id: Id
    active: Names = Field(min_length=1)
    passive: Names = ()
    pose_before: Pose
    pose_after: Pose
    waypoints: Annotated[tuple[Pose, ...], Field(fail_fast=True)] = Field(default=(), max_length=MAX_WAYPOINTS)
    grasp: str | None = None
    force: Annotated[Number, Field(ge=0, le=1e6, description="insertion force, N")] = 0.0
    fit: Annotated[Line, Field(min_length=1)] | None = None

    def motion(self) -> FloatArray:
        """pose_before, waypoints, pose_after; (k, 4, 4)."""
        return np.array([self.pose_before, *self.waypoints, self.pose_after])

    @model_validator(mode="after")
    def _steps_below_half_turn(self) -> "OperationEntry":
        for step, turn_rad in enumerate(_turns_rad(self.motion())):
            if turn_rad >= HALF_TURN_RAD:
                at = ("waypoints", step) if step < len(self.waypoints) else ("pose_after",)
                turned = f"{np.degrees(turn_rad):.1f}"
                raise PydanticCustomError(
                    "half_turn", "turns by {turned}° from the pose before it; less than 180° a step", {"turned": turned, "at": at}
                )
        return self


class ProductManifest(_Entry):
    """The document of a product package."""

    part_number: Annotated[Line, AfterValidator(_check_part_number)]
    revision: Line = ""
    name: Line = ""
    external_ids: ExternalIds = {}
    components: tuple[ComponentEntry, ...] = Field(min_length=1, max_length=MAX_COMPONENTS)
    environment: tuple[ObstacleEntry, ...] = Field(default=(), max_length=MAX_COMPONENTS)
    operations: tuple[OperationEntry, ...] = Field(default=(), max_length=MAX_OPERATIONS)

    def files(self) -> Iterator[tuple[str, int, ComponentEntry | ObstacleEntry]]:
        """Everything that has a CAD file: where it stands in the document, its index there, and itself."""
        yield from (("components", k, entry) for k, entry in enumerate(self.components))
        yield from (("environment", k, entry) for k, entry in enumerate(self.environment))


_LISTS: Mapping[str, tuple[type[BaseModel], int]] = {
    "components": (ComponentEntry, MAX_COMPONENTS),
    "environment": (ObstacleEntry, MAX_COMPONENTS),
    "operations": (OperationEntry, MAX_OPERATIONS),
}


def _turns_rad(motion: FloatArray) -> FloatArray:
    """Angle between neighbouring rotations of a motion (k, 4, 4), (k - 1,)."""
    relative = [np.swapaxes(a[:3, :3], 0, 1) @ b[:3, :3] for a, b in pairwise(motion)]
    R = np.array(relative)  # (k - 1, 3, 3)
    sine = np.linalg.norm(np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]]), axis=0) / 2
    cosine = (np.trace(R, axis1=1, axis2=2) - 1) / 2
    return np.asarray(np.arctan2(sine, cosine))


def read_manifest(document: bytes, limits: Limits = DEFAULT_LIMITS) -> ProductManifest:
    """The checked document; InvalidInput names every fault by its JSON pointer. Files are not looked at."""
    return manifest_of(parse_json(document, "product.json", limits.max_document_bytes))


def manifest_of(value: Any) -> ProductManifest:
    """The checked manifest of a JSON value; InvalidInput names every fault."""
    checked, faults = checked_entries(value, _LISTS)
    faults += _reference_faults(value)
    known = tuple(pointer(key) for key in _LISTS if any(fault.pointer.startswith(pointer(key, "")) for fault in faults))
    try:
        manifest = ProductManifest.model_validate(checked)
    except ValidationError as error:
        faults = [fault for fault in faults_of(error) if not fault.pointer.startswith(known)] + faults
    if faults:
        refuse("the product is not described correctly", faults)
    return manifest


def _reference_faults(value: Any) -> list[Fault]:
    """Names given twice or unknown, and the order of the operations."""
    components, obstacles, operations = (entries(value, key) for key in ("components", "environment", "operations"))
    component_ids = [id_ for entry in components if (id_ := string_of(entry, "id")) is not None]
    faults = duplicate_faults(components, "components") + duplicate_faults(obstacles, "environment")
    faults += sequence_faults(operations, component_ids)
    known = {string_of(entry, "id") for entry in operations}
    for k, obstacle in enumerate(obstacles):
        for j, name in enumerate(entries(obstacle, "operations")):
            if isinstance(name, str) and name not in known:
                faults.append(Fault(f"/environment/{k}/operations/{j}", f"unknown operation {name!r}"))
    return faults
