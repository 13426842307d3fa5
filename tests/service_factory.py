"""Products and designs for tests of the service, made by code and stored without the CAD files' detour."""

import io
import itertools
import json
import zipfile

import numpy as np

from gripwright.cad.export import stl_bytes
from gripwright.cad.manifest import manifest_of
from gripwright.cad.package import Product
from gripwright.domain.shape import Mesh
from gripwright.jobs.products import register_product
from gripwright.store.columns import utc_now
from gripwright.store.jobs import StoredDesignJobs

IDENTITY = np.eye(4).tolist()
_numbers = itertools.count(1)


def new_part_number():
    return f"T-{next(_numbers)}"


def make_wedge(size_mm=10.0):
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]) * size_mm
    return Mesh(vertices_mm=vertices, faces=np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]))


def raised(height_mm):
    return [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, height_mm], [0, 0, 0, 1]]


def make_document(part_number=None, **fields):
    component = {"file": "wedge.stl", "units": "mm", "pose": IDENTITY, "part_number": "P", "revision": "A"}
    return {
        "part_number": part_number or new_part_number(),
        "revision": "A",
        "name": "Pump",
        "components": [{"id": "base", **component}, {"id": "rotor", **component}],
        "operations": [
            {"id": "op-1", "active": ["rotor"], "passive": ["base"], "pose_before": raised(50), "pose_after": IDENTITY}
        ],
        **fields,
    }


def make_package(document, size_mm=10.0):
    """A .zip of the document and the wedge."""
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w") as archive:
        archive.writestr("product.json", json.dumps(document))
        archive.writestr("wedge.stl", stl_bytes(make_wedge(size_mm)))
    return target.getvalue()


def make_product(document=None):
    manifest = manifest_of(document or make_document())
    return Product(manifest=manifest, meshes={entry.id: make_wedge() for entry in manifest.components}, obstacle_meshes={})


def store_product(database, artifacts, document=None):
    """The id of a product registered as the service does it."""
    with database.write_sessions.begin() as session:
        row, _ = register_product(session, artifacts, make_product(document), utc_now())
        return row.id


def finish_design(database, artifacts, design_id, files):
    """End a design as a worker would: complete, with a bill of one finger, and files by their paths."""
    jobs = StoredDesignJobs(database, artifacts)
    finger = {"gripper": "G1", "item": "finger", "part_number": "F-1", "make_or_buy": "make", "maker": "", "model": ""}
    finger |= {"description": "", "material": "PA", "quantity": 2, "mass_kg": 0.1, "operations": ["op-1"], "files": []}
    document = {"product": {"part_number": "P", "revision": "A"}, "status": "complete", "operations": [{"id": "op-1"}]}
    assert jobs.start(design_id, 1)
    stored = {path: artifacts.put(content) for path, content in files.items()}
    jobs.finish(design_id, 1, "complete", {**document, "grippers": [], "bom": [finger]}, stored)
