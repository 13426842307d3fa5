"""Products: read from an upload, stored whole or not at all, and changed without reading the CAD files again."""

import hashlib
from collections.abc import Mapping
from datetime import datetime
from typing import Any

from sqlalchemy.orm import Session

from gripwright.cad.colour import component_glb
from gripwright.cad.manifest import ProductManifest, manifest_of
from gripwright.cad.operations import validate_operations
from gripwright.cad.package import Product, assembly_task
from gripwright.design.records import dumps, loads, record_types
from gripwright.domain.assembly import AssemblyTask, Component, GraspRegion, Obstacle, Operation
from gripwright.domain.errors import Conflict, Fault, InvalidInput
from gripwright.domain.shape import Mesh
from gripwright.store.artifacts import ArtifactStore
from gripwright.store.columns import new_id
from gripwright.store.designs import DesignRepository
from gripwright.store.models import ComponentRow, ExternalIdRow, ProductRow
from gripwright.store.products import ProductRepository

TASK_TYPES = record_types((AssemblyTask, Component, GraspRegion, Mesh, Obstacle, Operation))
CHANGEABLE = ("no_grasp", "may_grasp", "density", "friction", "texture", "ferrous", "external_ids")  # of a component
CHANGEABLE_OF_PRODUCT = ("name", "external_ids")


def register_product(session: Session, artifacts: ArtifactStore, product: Product, now: datetime) -> tuple[ProductRow, bool]:
    """Store a product; whether it is new comes second. Conflict where its part number and revision have other content.

    Content is what is designed from: other external ids are no other content, and those of the stored product stay.
    """
    manifest, task = product.manifest, assembly_task(product)
    content = dumps(task)
    existing = _same_product(session, manifest, hashlib.sha256(content).hexdigest())
    if existing is not None:
        return existing, False
    sha256 = artifacts.put(content)  # now that it is needed: what is refused leaves no file
    row = ProductRow(
        id=new_id(now),
        part_number=manifest.part_number,
        revision=manifest.revision,
        name=manifest.name,
        content_sha256=sha256,
        task_sha256=sha256,
        manifest=_document(manifest),
        warnings=list(task.warnings),
        version=1,
        created_at=now,
        updated_at=now,
        components=[_component_row(artifacts, position, component) for position, component in enumerate(task.components)],
        external_ids=_external_id_rows(manifest),
    )
    ProductRepository(session).add(row)
    return row, True


def check_product(session: Session, product: Product) -> tuple[ProductRow | None, str]:
    """What `register_product` would find, with the sha-256 of the content; nothing is stored. Conflict as there."""
    sha256 = hashlib.sha256(dumps(assembly_task(product))).hexdigest()
    return _same_product(session, product.manifest, sha256), sha256


def _same_product(session: Session, manifest: ProductManifest, sha256: str) -> ProductRow | None:
    """The stored product of that part number and revision; Conflict where its content is another."""
    existing = ProductRepository(session).find(manifest.part_number, manifest.revision)
    if existing is not None and existing.content_sha256 != sha256:
        raise Conflict(
            f"product {manifest.part_number} revision {manifest.revision!r} exists with other content: give a new revision",
            product_id=existing.id,
        )
    return existing


def replace_operations(session: Session, artifacts: ArtifactStore, row: ProductRow, value: Any, now: datetime) -> None:
    """Give a product another assembly sequence, a JSON value as in product.json; InvalidInput names every fault."""
    component_ids = [entry["id"] for entry in row.manifest["components"]]
    entries = validate_operations(value, component_ids)
    operations = [entry.model_dump(mode="json") for entry in entries]
    _change(session, artifacts, row, manifest_of({**row.manifest, "operations": operations}), now)


def change_component(
    session: Session, artifacts: ArtifactStore, row: ProductRow, component: ComponentRow, patch: Mapping[str, Any], now: datetime
) -> None:
    """Merge a patch (RFC 7396) into what may be changed of a component; null restores the default."""
    _check_names(patch, CHANGEABLE, "component")
    entries = list(row.manifest["components"])
    entries[component.position] = _merged(entries[component.position], patch)
    prefix = f"/components/{component.position}"
    try:
        manifest = manifest_of({**row.manifest, "components": entries})
    except InvalidInput as error:
        faults = [Fault(pointer=fault.pointer.removeprefix(prefix), message=fault.message) for fault in error.faults]
        raise InvalidInput("the component cannot be changed so", faults=tuple(faults)) from None
    _change(session, artifacts, row, manifest, now)


def change_product(session: Session, artifacts: ArtifactStore, row: ProductRow, patch: Mapping[str, Any], now: datetime) -> None:
    """Merge a patch (RFC 7396) into a product's name and external ids; null restores the default."""
    _check_names(patch, CHANGEABLE_OF_PRODUCT, "product")
    manifest = manifest_of(_merged(row.manifest, patch))
    row.name, row.external_ids = manifest.name, _external_id_rows(manifest)
    _change(session, artifacts, row, manifest, now)


def _check_names(patch: Mapping[str, Any], changeable: tuple[str, ...], what: str) -> None:
    faults = [
        Fault(pointer="/" + name.replace("~", "~0").replace("/", "~1"), message=f"cannot be changed; {', '.join(changeable)} can")
        for name in patch
        if name not in changeable
    ]
    if faults:
        raise InvalidInput(f"the {what} cannot be changed so", faults=tuple(faults))


def _merged(target: Mapping[str, Any], patch: Mapping[str, Any]) -> dict[str, Any]:
    """A document with a patch merged in. No member that may be changed holds objects in objects: two levels are enough."""
    merged = dict(target)
    for name, value in patch.items():
        if isinstance(value, Mapping):
            present = merged.get(name)
            inner = {**(present if isinstance(present, Mapping) else {}), **value}
            merged[name] = {key: element for key, element in inner.items() if element is not None}
        elif value is None:
            merged.pop(name, None)
        else:
            merged[name] = value
    return merged


def component_mesh(session: Session, product_id: str, component_id: str, colour: str | None) -> str:
    """The artifact of a component's mesh as GLB; Conflict where colours are asked for that no design has made yet."""
    _, component = ProductRepository(session).component(product_id, component_id)
    if colour is None:
        return component.glb_sha256
    file = DesignRepository(session).latest_file(product_id, f"components/{component_id}.{colour}.glb")
    if file is None:
        raise Conflict(f"no design of this product has coloured {component_id} by {colour} yet: request one, then ask again")
    return file.sha256


def load_task(artifacts: ArtifactStore, sha256: str) -> AssemblyTask:
    """A stored assembly task."""
    task: AssemblyTask = loads(artifacts.get(sha256), TASK_TYPES)
    return task


def _change(session: Session, artifacts: ArtifactStore, row: ProductRow, manifest: ProductManifest, now: datetime) -> None:
    """Store the task of a changed manifest, with the meshes that are there already."""
    before = load_task(artifacts, row.task_sha256)
    product = Product(
        manifest=manifest,
        meshes={component.id: component.mesh for component in before.components},
        obstacle_meshes={obstacle.id: obstacle.mesh for obstacle in before.obstacles},
    )
    task = assembly_task(product)
    row.task_sha256 = artifacts.put(dumps(task))
    row.manifest = _document(manifest)
    row.warnings = list(task.warnings)
    ProductRepository(session).changed(row, now)


def _document(manifest: ProductManifest) -> dict[str, Any]:
    return manifest.model_dump(mode="json")


def _external_id_rows(manifest: ProductManifest) -> list[ExternalIdRow]:
    return [ExternalIdRow(system=system, value=value) for system, value in manifest.external_ids.items()]


def _component_row(artifacts: ArtifactStore, position: int, component: Component) -> ComponentRow:
    used = component.mesh.vertices_mm[component.mesh.faces.ravel()]  # (3 m, 3)
    return ComponentRow(
        id=component.id,
        position=position,
        glb_sha256=artifacts.put(component_glb(component.id, component.mesh)),
        faces=len(component.mesh.faces),
        bounds_min_mm=used.min(axis=0).tolist(),
        bounds_max_mm=used.max(axis=0).tolist(),
    )
