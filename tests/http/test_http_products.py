import json

import numpy as np
import pytest

from gripwright.cad.export import step_bytes, stl_bytes
from gripwright.geometry.brep import box, write_brep
from gripwright.geometry.measures import face_areas_mm2
from gripwright.jobs.products import load_task
from gripwright.store.models import ProductRow
from service_factory import IDENTITY, make_document, make_package, make_wedge, new_part_number, raised

PRODUCTS = "/api/v1/products"


def upload(client, package, name="package.zip"):
    return client.post(PRODUCTS, files={"package": (name, package, "application/octet-stream")})


def test_a_package_becomes_a_product_whose_location_answers_with_it(client):
    document = make_document()

    created = upload(client, make_package(document))

    assert created.status_code == 201
    read = client.get(created.headers["Location"])
    assert read.json() == created.json()
    assert read.headers["ETag"] == created.headers["ETag"]
    assert [component["id"] for component in read.json()["components"]] == ["base", "rotor"]
    assert read.json()["components"][0]["bounds"] == {"min": [0.0, 0.0, 0.0], "max": [10.0, 10.0, 10.0]}
    assert read.json()["operations"][0]["pose_before"] == raised(50)


def test_the_same_content_again_is_the_same_product_and_other_content_a_conflict(client, problem):
    document = make_document()
    first = upload(client, make_package(document))

    again = upload(client, make_package(document))
    other = upload(client, make_package(document, size_mm=11.0))

    assert again.status_code == 200
    assert again.json()["id"] == first.json()["id"]
    problem(other, 409, "conflict")


def test_cad_files_may_come_as_parts_beside_a_manifest(client):
    files = [
        ("manifest", (None, json.dumps(make_document()))),
        ("files", ("wedge.stl", stl_bytes(make_wedge()))),
    ]

    created = client.post(PRODUCTS, files=files)

    assert created.status_code == 201, created.text


def test_a_step_assembly_may_come_alone_and_keeps_its_faces(client, service):
    block = step_bytes(write_brep(box((0, 0, 0), (10, 20, 30))), name=new_part_number(), part_number="B-1")

    created = upload(client, block, "block.step")

    assert created.status_code == 201, created.text
    with service.database.read_sessions() as session:
        task = load_task(service.artifacts, session.get(ProductRow, created.json()["id"]).task_sha256)
    mesh = task.components[0].mesh
    assert np.bincount(mesh.cad_faces, weights=face_areas_mm2(mesh)) == pytest.approx([600, 600, 300, 300, 200, 200])


def test_every_fault_of_a_package_is_named_and_nothing_is_stored(client, service, problem):
    document = make_document()
    document["components"][1]["file"] = "missing.stl"
    document["operations"][0]["active"] = ["nobody"]

    body = problem(upload(client, make_package(document)), 422, "invalid-input")

    assert {error["pointer"] for error in body["errors"]} >= {"/components/1/file", "/operations/0/active/0"}
    assert client.get(PRODUCTS, params={"part_number": document["part_number"]}).json()["items"] == []


@pytest.mark.parametrize(
    ("files", "pointer"),
    [
        ({"package": ("package.zip", b"no archive")}, None),
        ({"package": ("wedge.stl", b"solid")}, "wedge.stl"),
        ({"a": ("a.stl", b""), "b": ("b.stl", b"")}, "manifest"),
        ({"manifest": (None, "{}"), "files": ("../../evil.stl", b"")}, "../../evil.stl"),
        ({"manifest": (None, "{"), "files": ("a.stl", b"")}, "product.json"),
    ],
)
def test_uploads_that_are_no_product_are_refused_with_the_place(client, problem, files, pointer):
    body = problem(client.post(PRODUCTS, files=files), 422)

    assert pointer is None or pointer in {error["pointer"] for error in body["errors"]}


def test_an_upload_must_be_multipart(client, problem):
    problem(client.post(PRODUCTS, json={}), 415)
    problem(client.post(PRODUCTS, content=b"x", headers={"content-type": "multipart/form-data"}), 400)


def test_uploads_beyond_the_limit_are_refused_announced_or_not(client, problem):
    problem(upload(client, bytes(300_000)), 413, "limit-exceeded")

    def chunks():
        yield b'--b\r\ncontent-disposition: form-data; name="package"; filename="p.zip"\r\n\r\n'
        for _ in range(40):
            yield bytes(10_000)

    streamed = client.post(PRODUCTS, content=chunks(), headers={"content-type": "multipart/form-data; boundary=b"})
    problem(streamed, 413)


def test_pages_follow_the_cursor_and_lose_or_repeat_nothing(client, service):
    from service_factory import store_product

    number = new_part_number()
    for revision in "ABCDE":
        store_product(service.database, service.artifacts, make_document(number, revision=revision))

    seen, url = [], f"{PRODUCTS}?part_number={number}&limit=2"
    while url is not None:
        answer = client.get(url)
        seen += [item["revision"] for item in answer.json()["items"]]
        assert (answer.json()["next_cursor"] is None) == ("next" not in answer.links)
        url = answer.links["next"]["url"] if "next" in answer.links else None

    assert seen == list("ABCDE")


@pytest.mark.parametrize("query", ["cursor=nonsense", "cursor=MjAyNg==", "limit=0", "limit=201", "limit=x"])
def test_a_page_that_cannot_be_is_refused_with_a_pointer(client, problem, query):
    body = problem(client.get(f"{PRODUCTS}?{query}"), 422)

    assert body["errors"][0]["pointer"] == f"/query/{query.partition('=')[0]}"


def test_an_unchanged_product_is_not_sent_again(client, product_id):
    tag = client.get(f"{PRODUCTS}/{product_id}").headers["ETag"]

    answer = client.get(f"{PRODUCTS}/{product_id}", headers={"If-None-Match": f'"0", {tag}'})

    assert answer.status_code == 304
    assert answer.content == b""


def test_only_the_version_that_was_seen_is_deleted(client, product_id, problem):
    url = f"{PRODUCTS}/{product_id}"
    tag = client.get(url).headers["ETag"]

    problem(client.delete(url), 428, "precondition-required")
    problem(client.delete(url, headers={"If-Match": '"99"'}), 412, "precondition-failed")
    problem(client.delete(url, headers={"If-Match": f"W/{tag}"}), 412)
    assert client.delete(url, headers={"If-Match": tag}).status_code == 204
    problem(client.get(url), 404, "not-found")


def test_a_product_is_not_deleted_under_a_design_that_waits(client, product_id, design_id, problem):
    url = f"{PRODUCTS}/{product_id}"

    problem(client.delete(url, headers={"If-Match": "*"}), 409, "conflict")

    client.post(f"/api/v1/jobs/{design_id}/cancel")
    assert client.delete(url, headers={"If-Match": "*"}).status_code == 204
    problem(client.get(f"/api/v1/designs/{design_id}"), 404)


def test_operations_are_replaced_and_change_the_entity_tag(client, product_id, problem):
    url = f"{PRODUCTS}/{product_id}"
    before = client.get(url).headers["ETag"]
    operation = {"id": "op-9", "active": ["base"], "passive": [], "pose_before": raised(80), "pose_after": IDENTITY}

    answer = client.put(f"{url}/operations", json={"operations": [operation]}, headers={"If-Match": before})

    assert answer.status_code == 200, answer.text
    assert [item["id"] for item in answer.json()["operations"]] == ["op-9"]
    assert answer.headers["ETag"] != before
    assert client.get(url).json() == answer.json()
    problem(client.put(f"{url}/operations", json=[operation], headers={"If-Match": before}), 412)
    assert client.put(f"{url}/operations", json=[operation]).status_code == 200


def test_each_fault_of_a_sequence_has_its_pointer_and_changes_nothing(client, product_id, problem):
    url = f"{PRODUCTS}/{product_id}"
    before = client.get(url).headers["ETag"]
    skewed = [[2, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
    operations = [
        {"id": "op-1", "active": ["ghost"], "passive": [], "pose_before": raised(9), "pose_after": IDENTITY},
        {"id": "op-2", "active": ["rotor"], "passive": [], "pose_before": skewed, "pose_after": IDENTITY},
    ]

    before = client.get(url)

    body = problem(client.put(f"{url}/operations", json={"operations": operations}), 422, "invalid-input")

    assert {error["pointer"] for error in body["errors"]} >= {"/operations/0/active/0", "/operations/1/pose_before"}
    after = client.get(url)
    assert (after.headers["ETag"], after.json()) == (before.headers["ETag"], before.json())


def test_a_component_is_patched_by_merging(client, product_id):
    url = f"{PRODUCTS}/{product_id}/components/rotor"
    region = {"reason": "teeth", "box": {"min": [0, 0, 0], "max": [1, 1, 1]}}

    patched = client.patch(url, json={"no_grasp": [region], "density": 2700})
    restored = client.patch(url, json={"density": None}, headers={"content-type": "application/merge-patch+json"})

    assert patched.status_code == 200, patched.text
    assert patched.json()["density"] == 2700
    assert patched.json()["no_grasp"][0]["reason"] == "teeth"
    assert restored.json()["density"] == 7850
    assert restored.json()["no_grasp"] == patched.json()["no_grasp"]
    assert restored.headers["ETag"] == '"3"'
    assert client.get(url).json() == restored.json()


@pytest.mark.parametrize(
    ("patch", "pointer"),
    [
        ({"density": -1}, "/density"),
        ({"friction": "much"}, "/friction"),
        ({"pose": IDENTITY}, "/pose"),
        ({"no_grasp": [{"reason": "x"}]}, "/no_grasp/0"),
    ],
)
def test_a_patch_that_cannot_be_is_refused_with_a_pointer(client, product_id, problem, patch, pointer):
    body = problem(client.patch(f"{PRODUCTS}/{product_id}/components/rotor", json=patch), 422)

    assert [error["pointer"] for error in body["errors"]] == [pointer]


def test_a_patch_must_be_json(client, product_id, problem):
    url = f"{PRODUCTS}/{product_id}/components/rotor"

    problem(client.patch(url, content=b"density=1", headers={"content-type": "application/x-www-form-urlencoded"}), 415)
    problem(client.patch(url, content=b"{", headers={"content-type": "application/json"}), 422)
    problem(client.patch(f"{PRODUCTS}/{product_id}/components/ghost", json={}), 404)


def test_a_mesh_is_a_glb_and_has_colours_once_a_design_has_made_them(client, product_id, design_id, finish, problem):
    url = f"{PRODUCTS}/{product_id}/components/rotor/mesh.glb"

    plain = client.get(url)
    problem(client.get(url, params={"colour": "segment"}), 409)
    problem(client.get(url, params={"colour": "red"}), 422)
    finish(design_id, files={"components/rotor.segment.glb": b"glTF coloured"})

    assert plain.headers["content-type"] == "model/gltf-binary"
    assert plain.content[:4] == b"glTF"
    assert client.get(url, headers={"If-None-Match": plain.headers["ETag"]}).status_code == 304
    assert client.get(url, params={"colour": "segment"}).content == b"glTF coloured"
