"""Product packages: product.json and its CAD files, or a STEP assembly alone."""

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gripwright.cad.archive import PackageFiles, inner_package, open_archive, open_package_files
from gripwright.cad.document import parse_json, refuse
from gripwright.cad.formats import format_of
from gripwright.cad.limits import DEFAULT_LIMITS, Limits
from gripwright.cad.manifest import MAX_COMPONENTS, ComponentEntry, ObstacleEntry, ProductManifest, RegionEntry, manifest_of
from gripwright.cad.operations import operation_of
from gripwright.cad.reader import Assembly, CadReader
from gripwright.cad.sequence import entries, string_of
from gripwright.cad.spare import SpareReader
from gripwright.domain.assembly import AssemblyTask, Component, GraspRegion, Obstacle, Operation
from gripwright.domain.errors import Fault, InvalidGeometry, InvalidInput, LimitExceeded
from gripwright.domain.shape import Mesh

DOCUMENT = "product.json"
_IN_PLACE_MM = 1e-3
_IN_PLACE = 1e-5  # of a rotation from the identity


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Product:
    """A package as read: its document and the mesh of each component and obstacle by id, mm; equal files share one mesh."""

    manifest: ProductManifest
    meshes: Mapping[str, Mesh]
    obstacle_meshes: Mapping[str, Mesh]


def read_package(path: Path, limits: Limits = DEFAULT_LIMITS, operations: Path | None = None) -> AssemblyTask:
    """The assembly task of a folder, a .zip or a lone STEP assembly; `operations` replaces the document's own.

    InvalidInput names every fault of the document and of the files together; LimitExceeded stops at the first excess.
    """
    return assembly_task(read_product(path, limits, operations))


def read_product(path: Path, limits: Limits = DEFAULT_LIMITS, operations: Path | None = None) -> Product:
    """What `read_package` reads, before it becomes a task."""
    sequence = None if operations is None else _sequence_of(operations, limits)
    if path.is_file() and format_of(path.name) == "step":
        return _read_step_product(path.name, path.read_bytes(), limits, sequence)
    return _read_files(open_package_files(path, limits), path.name, limits, sequence)


def read_upload(files: PackageFiles, limits: Limits, spare: SpareReader | None = None) -> Product:
    """The product of files that came one by one: the document with its CAD files, or one .zip or STEP assembly alone.

    `spare` holds a process ahead that reads CAD files.
    """
    if DOCUMENT in files.names:
        return _read_files(files, "the upload", limits, None, spare)
    if len(files.names) != 1:
        message = f"{len(files.names)} files and no manifest part; a .zip or a STEP assembly may stand alone"
        raise InvalidInput("the upload is no product", faults=(Fault("manifest", message),))
    (name,) = files.names
    if format_of(name) == "step":
        return _read_step_product(name, files.read(name), limits, None, spare)
    if not name.lower().endswith(".zip"):
        fault = Fault(name, "neither a .zip nor a STEP assembly (.step, .stp)")
        raise InvalidInput("the upload is no product", faults=(fault,))
    return _read_files(inner_package(open_archive(files.read(name), name, limits)), name, limits, None, spare)


def _read_files(files: PackageFiles, label: str, limits: Limits, sequence: Any, spare: SpareReader | None = None) -> Product:
    if DOCUMENT in files.names:
        value = parse_json(files.read(DOCUMENT), DOCUMENT, limits.max_document_bytes)
        if sequence is not None and isinstance(value, dict):
            value = {**value, "operations": sequence}
        return _read_described(value, files, limits, spare)
    alone = [name for name in files.names if format_of(name) == "step"]
    if len(alone) != 1:
        message = f"no {DOCUMENT}, and {len(alone)} STEP files where one could stand alone"
        raise InvalidInput(f"{label} is no product package: {message}", faults=(Fault(DOCUMENT, message),))
    return _read_step_product(alone[0], files.read(alone[0]), limits, sequence, spare)


def _sequence_of(path: Path, limits: Limits) -> Any:
    """The JSON value of the operations in a file: a list, or a list under `operations`."""
    if not path.is_file():
        raise InvalidInput(f"no such file: {path.name}", faults=(Fault(path.name, "no such file"),))
    value = parse_json(path.read_bytes(), path.name, limits.max_document_bytes)
    return value.get("operations") if isinstance(value, dict) else value


@dataclass(frozen=True, slots=True)
class _FileUse:
    """Where the document asks for a CAD file."""

    pointer: str
    file: str
    units: str | None


def _read_described(value: Any, files: PackageFiles, limits: Limits, spare: SpareReader | None) -> Product:
    """The product of a document and its files; everything that can be read is read, so that all faults come together."""
    faults: list[Fault] = []
    manifest = None
    try:
        manifest = manifest_of(value)
    except InvalidInput as error:
        faults += error.faults
    with CadReader(limits, spare) as reader:
        meshes = _read_meshes(list(_usable_uses(value, faults)), files, reader, faults)
    if manifest is None or faults:
        refuse("the product package cannot be used", faults)
    return Product(
        manifest=manifest,
        meshes={entry.id: meshes[entry.file, entry.units] for entry in manifest.components},
        obstacle_meshes={entry.id: meshes[entry.file, entry.units] for entry in manifest.environment},
    )


def _usable_uses(value: Any, faults: list[Fault]) -> Iterator[_FileUse]:
    """The files of those entries whose file name and units are not at fault themselves."""
    at_fault = {fault.pointer for fault in faults}
    for key in ("components", "environment"):
        for k, entry in enumerate(entries(value, key)):
            pointer, file = f"/{key}/{k}", string_of(entry, "file")
            if file is not None and not {f"{pointer}/file", f"{pointer}/units"} & at_fault:
                yield _FileUse(pointer, file, string_of(entry, "units"))


def _read_meshes(
    uses: list[_FileUse], files: PackageFiles, reader: CadReader, faults: list[Fault]
) -> dict[tuple[str, str | None], Mesh]:
    """The mesh of each distinct file and unit; what is missing or unreadable is added to the faults, at its first use."""
    meshes: dict[tuple[str, str | None], Mesh] = {}
    seen: set[tuple[str, str | None]] = set()
    for use in uses:
        if use.file not in files.names:
            faults.append(Fault(f"{use.pointer}/file", f"no file {use.file!r} in the package"))
        elif (use.file, use.units) not in seen:
            seen.add((use.file, use.units))
            try:
                data = files.read(use.file)
                meshes[use.file, use.units] = reader.mesh(use.file, data, str(format_of(use.file)), use.units)
            except (InvalidGeometry, InvalidInput) as error:
                faults.append(Fault(f"{use.pointer}/file", error.detail))
            except LimitExceeded as error:
                fault = Fault(f"{use.pointer}/file", error.detail)
                raise LimitExceeded(error.detail, faults=(*faults, fault)) from None
    return meshes


def _read_step_product(name: str, data: bytes, limits: Limits, sequence: Any, spare: SpareReader | None = None) -> Product:
    """The product of a STEP assembly: its components are the parts at the ends of the structure."""
    if len(data) > limits.max_file_bytes:
        raise LimitExceeded(f"{name} has {len(data)} bytes, at most {limits.max_file_bytes}")
    with CadReader(limits, spare) as reader:
        try:
            assembly = reader.assembly(name, data)
        except InvalidGeometry as error:
            raise InvalidInput("the STEP file cannot be used", faults=(Fault(name, error.detail),)) from None
    if len(assembly.instances) > MAX_COMPONENTS:
        raise LimitExceeded(f"{name} has {len(assembly.instances)} components, at most {MAX_COMPONENTS}")
    ids = _component_ids(assembly)
    components = [
        {
            "id": id_,
            "part_number": _line(instance.product),
            "name": _line(instance.path[-1]),
            "file": name,
            "pose": instance.X_PC.tolist(),
        }
        for id_, instance in zip(ids, assembly.instances, strict=True)
    ]
    title = _line(assembly.name)
    value = {"part_number": title or Path(name).stem, "name": title, "components": components}
    manifest = manifest_of(value if sequence is None else {**value, "operations": sequence})
    meshes = {id_: instance.mesh for id_, instance in zip(ids, assembly.instances, strict=True)}
    return Product(manifest=manifest, meshes=meshes, obstacle_meshes={})


def _line(text: str) -> str:
    """A STEP file's text as one printable line."""
    return "".join(c if c.isprintable() else " " for c in text).strip()[:500]


def _component_ids(assembly: Assembly) -> list[str]:
    """An id of each instance from the names on its path, counted where two would be the same."""
    ids: dict[str, None] = {}
    used: Counter[str] = Counter()
    for instance in assembly.instances:
        name = re.sub(r"[^\w.]+|_+", "-", "-".join(instance.path).lower()).strip("-.") or "component"
        base = name[-150:]
        candidate = base
        while candidate in ids:
            used[base] += 1
            candidate = f"{base}-{used[base] + 1}"
        ids[candidate] = None
    return list(ids)


def assembly_task(product: Product) -> AssemblyTask:
    """The task of a product as read."""
    manifest = product.manifest
    operations = tuple(operation_of(entry) for entry in manifest.operations)
    return AssemblyTask(
        part_number=manifest.part_number,
        revision=manifest.revision,
        name=manifest.name,
        components=tuple(_component(entry, product.meshes[entry.id]) for entry in manifest.components),
        obstacles=tuple(_obstacle(entry, product.obstacle_meshes[entry.id]) for entry in manifest.environment),
        operations=operations,
        warnings=(*_unit_warnings(manifest), *_place_warnings(operations)),
    )


def _component(entry: ComponentEntry, mesh: Mesh) -> Component:
    return Component(
        id=entry.id,
        mesh=mesh,
        X_PC=np.array(entry.pose),
        part_number=entry.part_number,
        revision=entry.revision,
        name=entry.name,
        density_kg_m3=entry.density,
        friction=entry.friction,
        texture=entry.texture,
        ferrous=entry.ferrous,
        no_grasp=tuple(map(grasp_region, entry.no_grasp)),
        may_grasp=tuple(map(grasp_region, entry.may_grasp)),
    )


def _obstacle(entry: ObstacleEntry, mesh: Mesh) -> Obstacle:
    return Obstacle(id=entry.id, mesh=mesh, X_PE=np.array(entry.pose), operations=entry.operations)


def grasp_region(entry: RegionEntry) -> GraspRegion:
    """The region as the calculation knows it."""
    if entry.box is None:
        return GraspRegion(reason=entry.reason, segments=entry.segments)
    return GraspRegion(reason=entry.reason, box_min_C=np.array(entry.box.min), box_max_C=np.array(entry.box.max))


def _unit_warnings(manifest: ProductManifest) -> Iterator[str]:
    for file in sorted({e.file for _, _, e in manifest.files() if format_of(e.file) == "glb" and e.units not in {None, "m"}}):
        yield f"{file}: its numbers are taken in the units that product.json states, though glTF means metres"


def _place_warnings(operations: tuple[Operation, ...]) -> Iterator[str]:
    """Components whose last operation leaves them beside their place in the product."""
    last = {name: operation for operation in operations for name in operation.active}
    for name, operation in last.items():
        X = operation.motion[-1]
        if np.linalg.norm(X[:3, 3]) > _IN_PLACE_MM or np.abs(X[:3, :3] - np.eye(3)).max() > _IN_PLACE:
            yield f"operation {operation.id!r} leaves component {name!r} beside its place in the product"
