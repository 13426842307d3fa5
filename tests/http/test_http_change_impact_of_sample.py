"""A component of the sample grows by 3 mm: the operations and grippers that this breaks, and no others, are named."""

import json
import shutil

import numpy as np
import pytest
import trimesh

from checker.promises import check_design
from designed_products import COMPLETE, PUMP
from service_factory import make_document, store_product

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]

GROWN, GROWTH_MM = "front-cover", 3.0


@pytest.fixture(scope="module")
def revised(tmp_path_factory):
    """The sample with the outer diameters of one component, Ø 100 and Ø 118, larger by 3 mm."""
    package = tmp_path_factory.mktemp("revised") / "pump"
    shutil.copytree(PUMP, package)
    mesh = trimesh.load(package / f"{GROWN}.stl")
    radius = np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 1])
    outer = radius > 49.0
    mesh.vertices[outer, :2] *= (1.0 + GROWTH_MM / 2.0 / radius[outer])[:, None]
    mesh.export(package / f"{GROWN}.stl")
    document = json.loads((package / "product.json").read_text())
    (package / "product.json").write_text(json.dumps({**document, "revision": "B"}))
    return package


def outer_diameters(package):
    """The diameters at which the component can be gripped from outside, read off its vertices."""
    vertices = trimesh.load(package / f"{GROWN}.stl").vertices
    radius = np.hypot(vertices[:, 0], vertices[:, 1])
    return {round(2.0 * radius[vertices[:, 2] > z].max(), 2) for z in (5.0, 12.0)}


def documents_of(folder):
    return json.loads((folder / "design.json").read_text())


def test_a_diameter_larger_by_3_mm_breaks_the_operation_and_the_gripper_that_it_must(client, service, jobs, designed, revised):
    code, folder = designed(PUMP)
    before = documents_of(folder)
    assert code == COMPLETE
    did = {handle["operation"]: gripper for gripper in before["grippers"] for handle in gripper["handles"]}
    # A judge that shares no code with the product: which of the grippers at hand still do their operations on the revision.
    broken = {fault.operation for fault in check_design(folder, revised) if fault.operation}
    assert outer_diameters(revised) == {103.0, 121.0}
    assert max(gripper["opening_max"] for gripper in before["grippers"]) < 103.0 + 1.0  # none opens so far

    def end(design_id, document):
        assert jobs.start(design_id, 1)
        jobs.finish(design_id, 1, document["status"], document, {"bom.csv": service.artifacts.put(b"")})

    ids = [store_product(service.database, service.artifacts, make_document(part_number="CP", revision=r)) for r in "AB"]
    end(client.post(f"/api/v1/products/{ids[0]}/designs", json={}).json()["id"], before)
    url, body = f"/api/v1/products/{ids[0]}/change-impact", {"revision": ids[1]}
    queued = client.get(client.post(url, json=body).json()["design"]).json()
    end(queued["id"], documents_of(designed(revised, (f"owned={json.dumps(queued['options']['owned'])}",))[1]))

    impact = client.post(url, json=body).json()["impact"]

    assert broken == {"op-02"}
    assert {op["id"] for op in impact["operations"] if op["outcome"] != "held"} == broken
    assert {op["id"] for op in impact["operations"]} == set(did)
    for gripper in impact["grippers"]:
        own = {operation for operation, one in did.items() if one["id"] == gripper["id"]}
        assert (set(gripper["holds"]), set(gripper["no_longer_holds"])) == (own - broken, own & broken)
    assert [item["id"] for item in impact["components"] if item["outcome"] == "changed"] == [GROWN]
    assert len(impact["new_grippers"]) == 1
