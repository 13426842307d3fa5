import hashlib
import io
import json
import zipfile

import pytest
from openpyxl import load_workbook

from service_factory import make_document, store_product

XLSX = "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet"


def test_a_request_is_accepted_and_says_where_to_look_and_when(client, product_id):
    answer = client.post(f"/api/v1/products/{product_id}/designs", json={"options": {"margin": 0.2, "sdf.rays": 20}})

    assert answer.status_code == 202
    assert answer.headers["Retry-After"] == "1"
    design = client.get(answer.headers["Location"])
    assert design.json()["status"] == "queued"
    assert design.json()["progress"] == {"fraction": 0.0, "stage": "", "message": ""}
    assert design.json()["options"] == {"margin": 0.2, "sdf.rays": 20}
    assert design.json()["design"] is None
    assert design.headers["Retry-After"] == "1"


@pytest.mark.parametrize(
    ("body", "pointer"),
    [
        ({"options": {"margin": -1}}, "/options/margin"),
        ({"options": {"marginal": 1}}, "/options/marginal"),
        ({"options": {"segmenter": "magic"}}, "/options/segmenter"),
        ({"options": {"sdf.rays": "many"}}, "/options/sdf.rays"),
        ({"options": {"sdf.rays": 0}}, "/options/sdf.rays"),
        ({"options": {"sdf.beams": 3}}, "/options/sdf.beams"),
        ({"options": {"sdf": {"rays": 0}}}, "/options/sdf/rays"),
        ({"options": {"fitters": ["box", "egg"]}}, "/options/fitters/1"),
        ({"options": {"box.filled_min": 2}}, "/options/box.filled_min"),
        ({"options": {"threads.nothing": 2}}, "/options/threads.nothing"),
        ({"options": {"axial.depths": "six"}}, "/options/axial.depths"),
        ({"options": {"centric_3.width_mm": 0}}, "/options/centric_3.width_mm"),
        ({"options": {"set_cover.time_limit": -1}}, "/options/set_cover.time_limit"),
        ({"options": {"straight.material": "wood"}}, "/options/straight.material"),
        ({"options": {"cone.half_angle_min": 0}}, "/options/cone.half_angle_min"),
        ({"options": {"policies": ["never"]}}, "/options/policies/0"),
        ({"options": {"policies": ["prefer_makers"], "prefer_makers.factor": 0}}, "/options/prefer_makers.factor"),
        ({"options": {"policies": ["only_makers"], "only_makers.makers": "SCHUNK"}}, "/options/only_makers.makers"),
        ({"options": {"never_grip": {"share_min": True}}}, "/options/never_grip/share_min"),
        ({"options": {"egg.size": 1}}, "/options/egg"),
        ({"options": {"actuators": ["ACME/none"]}}, "/options/actuators/0"),
        ({"options": []}, "/options"),
        ({"wishes": {}}, "/wishes"),
    ],
)
def test_options_that_cannot_be_are_refused_with_their_place(client, product_id, problem, body, pointer):
    answer = problem(client.post(f"/api/v1/products/{product_id}/designs", json=body), 422)

    assert pointer in [error["pointer"] for error in answer["errors"]]


@pytest.mark.parametrize("segmenter", ["best", "primitives"])
def test_a_segmenter_can_be_chosen_and_so_can_the_better_of_two(client, product_id, segmenter):
    options = {"segmenter": segmenter, "primitives.angle": 15.0}

    answer = client.post(f"/api/v1/products/{product_id}/designs", json={"options": options})

    assert answer.status_code == 202
    assert client.get(answer.headers["Location"]).json()["options"] == options


def test_a_product_without_operations_cannot_be_designed_for(client, service, problem):
    product_id = store_product(service.database, service.artifacts, make_document(operations=[]))

    body = problem(client.post(f"/api/v1/products/{product_id}/designs", json={}), 422)

    assert body["errors"][0]["pointer"] == "/operations"
    problem(client.post("/api/v1/products/none/designs", json={}), 404)


def test_an_idempotency_key_gives_the_same_design_again_and_refuses_another_request(client, product_id, problem):
    url, headers = f"/api/v1/products/{product_id}/designs", {"Idempotency-Key": f"key-{product_id}"}
    first = client.post(url, json={"options": {"seed": 1}}, headers=headers)

    again = client.post(url, json={"options": {"seed": 1}}, headers=headers)

    assert again.status_code == 202
    assert again.json() == first.json()
    assert again.headers["Location"] == first.headers["Location"]
    problem(client.post(url, json={"options": {"seed": 2}}, headers=headers), 422)
    assert client.post(url, json={"options": {"seed": 1}}).json()["id"] != first.json()["id"]


def test_progress_is_seen_while_the_design_runs(client, design_id, jobs):
    jobs.start(design_id, 1)
    jobs.record_progress(design_id, 1, 0.4, "segment", "rotor")

    body = client.get(f"/api/v1/designs/{design_id}").json()

    assert body["status"] == "running"
    assert body["progress"] == {"fraction": 0.4, "stage": "segment", "message": "rotor"}


@pytest.mark.parametrize("status", ["complete", "incomplete"])
def test_a_finished_design_holds_its_document_and_files(client, design_id, finish, status):
    finish(design_id, status)

    answer = client.get(f"/api/v1/designs/{design_id}")

    body = answer.json()
    assert body["status"] == body["design"]["status"] == status
    assert [file["path"] for file in body["files"]] == ["bom.csv", "design.json", "grippers/G1/finger.step", "report.html"]
    assert "Retry-After" not in answer.headers
    for file in body["files"]:
        content = client.get(file["href"]).content
        assert (len(content), hashlib.sha256(content).hexdigest()) == (file["size"], file["sha256"])


def test_a_design_says_over_http_why_an_operation_is_not_covered(client, design_id, finish):
    sentence = (
        "gripped on Ø24.0 mm (segment 2), finger 2 would enter 'cover' by 1.80 mm (0.10 mm of clearance is required) with its tip"
    )
    miss = {"component": "rotor", "segment": 2, "sentence": sentence, "amount": 1.9, "unit": "mm", "hit": "cover"}
    operation = {"id": "op-1", "status": "uncovered", "detail": f"rotor cannot be held: {sentence}", "nearest_miss": miss}
    finish(design_id, "incomplete", operations=[operation])

    assert client.get(f"/api/v1/designs/{design_id}").json()["design"]["operations"] == [operation]


def test_a_failed_design_is_a_resource_that_says_why(client, design_id, jobs):
    jobs.start(design_id, 1)
    jobs.fail(design_id, 1, {"code": "step-failure", "detail": "the step 'segment' crashed with SIGSEGV"})

    answer = client.get(f"/api/v1/designs/{design_id}")

    assert answer.status_code == 200
    assert answer.json()["status"] == "failed"
    assert answer.json()["problem"]["detail"] == "the step 'segment' crashed with SIGSEGV"


def test_the_bom_comes_in_the_form_that_is_accepted(client, design_id, finish, problem):
    finish(design_id, operations=[{"id": "a"}, {"id": "b"}])
    url = f"/api/v1/designs/{design_id}/bom"

    plain = client.get(url)
    table = client.get(url, headers={"Accept": "text/csv"})
    workbook = client.get(url, headers={"Accept": f"application/json;q=0.5, {XLSX}"})

    rows = plain.json()["items"]
    assert [(row["item"], row["quantity"], row["mass_kg"]) for row in rows] == [("actuator", 1, 0.5), ("screw", 2, None)]
    assert table.headers["content-type"].startswith("text/csv")
    assert [line.split(",")[:3] for line in table.text.splitlines()] == [
        ["gripper", "item", "make_or_buy"],
        ["G1", "actuator", "buy"],
        ["G1", "screw", "buy"],
    ]
    assert workbook.headers["content-type"] == XLSX
    sheet = load_workbook(io.BytesIO(workbook.content)).active
    values = dict(zip((cell.value for cell in sheet[1]), (cell.value for cell in sheet[2]), strict=True))
    assert (values["gripper"], values["model"], values["mass_kg"], values["operations"]) == ("G1", "MHF2-12D2", 0.5, "a; b")
    assert sheet["E3"].data_type == "s", "a text that looks like a formula stays a text"
    problem(client.get(url, headers={"Accept": "image/png"}), 406, "not-acceptable")


def test_the_bom_comes_flat_and_in_levels_too(client, design_id, finish, problem):
    finish(design_id, operations=[{"id": "a"}, {"id": "b"}])
    url = f"/api/v1/designs/{design_id}/bom"

    flat = client.get(f"{url}?view=flat").json()["items"]
    levels = client.get(f"{url}?view=levels").json()["items"]
    table = client.get(f"{url}?view=levels", headers={"Accept": "text/csv"})
    workbook = client.get(f"{url}?view=levels", headers={"Accept": XLSX})

    assert [row["part_number"] for row in flat] == ["MHF2-12D2", "=1+1"]
    assert [(row["level"], row["item"]) for row in levels] == [(0, "gripper set"), (1, "gripper"), (2, "actuator"), (2, "screw")]
    assert [row["parent"] for row in levels[1:3]] == [row["part_number"] for row in levels[:2]]
    assert table.text.startswith("level,parent,gripper,")
    assert load_workbook(io.BytesIO(workbook.content)).sheetnames == ["bom-levels"]
    problem(client.get(f"{url}?view=none"), 422)


def test_there_is_no_bom_and_no_archive_before_the_design_is_done(client, design_id, problem):
    problem(client.get(f"/api/v1/designs/{design_id}/bom"), 404)
    problem(client.get(f"/api/v1/designs/{design_id}/package.zip"), 404)


def test_a_file_has_its_media_type_its_name_and_its_content_as_tag(client, design_id, finish, problem):
    finish(design_id)
    url = f"/api/v1/designs/{design_id}/files"

    step = client.get(f"{url}/grippers/G1/finger.step")
    report = client.get(f"{url}/report.html")

    assert step.headers["content-type"] == "model/step"
    assert step.headers["content-disposition"] == 'attachment; filename="finger.step"'
    assert step.headers["ETag"] == f'"{hashlib.sha256(step.content).hexdigest()}"'
    assert report.headers["content-disposition"].startswith("inline")
    assert "sandbox" in report.headers["content-security-policy"]
    assert client.get(f"{url}/report.html", headers={"If-None-Match": report.headers["ETag"]}).status_code == 304
    problem(client.get(f"{url}/none.step"), 404)
    problem(client.get(f"{url}/..%2f..%2fgripwright.db"), 404)


def test_ranges_of_a_file_are_served(client, design_id, finish, problem):
    finish(design_id)
    url = f"/api/v1/designs/{design_id}/files/grippers/G1/finger.step"

    part = client.get(url, headers={"Range": "bytes=0-12"})

    assert part.status_code == 206
    assert part.content == b"ISO-10303-21;"
    problem(client.get(url, headers={"Range": "bytes=9999-"}), 416)


def test_the_archive_holds_the_whole_folder_and_is_the_same_each_time(client, design_id, finish):
    finish(design_id)
    url = f"/api/v1/designs/{design_id}/package.zip"

    first, second = client.get(url), client.get(url)

    assert first.content == second.content
    with zipfile.ZipFile(io.BytesIO(first.content)) as archive:
        assert archive.testzip() is None
        assert archive.namelist() == ["bom.csv", "design.json", "grippers/G1/finger.step", "report.html"]
        assert json.loads(archive.read("design.json"))["status"] == "complete"


def test_a_range_is_of_the_file_that_the_caller_has_begun_with(client, design_id, finish):
    finish(design_id)
    for path, media_type in (("files/grippers/G1/finger.step", "model/step"), ("package.zip", "application/zip")):
        url = f"/api/v1/designs/{design_id}/{path}"
        whole = client.get(url)
        tag = whole.headers["ETag"]

        part = client.get(url, headers={"Range": "bytes=5-", "If-Range": tag})
        other = client.get(url, headers={"Range": "bytes=5-", "If-Range": '"other"'})

        assert (part.status_code, part.content) == (206, whole.content[5:])
        assert part.headers["Content-Range"] == f"bytes 5-{len(whole.content) - 1}/{len(whole.content)}"
        assert (part.headers["content-type"], part.headers["ETag"]) == (media_type, tag)
        assert (other.status_code, other.content) == (200, whole.content)
        assert client.get(url, headers={"If-None-Match": tag}).status_code == 304


def test_a_name_that_is_not_ascii_is_given_as_rfc_6266_says(client, service):
    document = make_document()
    document["components"][1]["id"] = document["operations"][0]["active"][0] = "Laufräd"
    product = store_product(service.database, service.artifacts, document)

    answer = client.get(f"/api/v1/products/{product}/components/Laufräd/mesh.glb")

    assert answer.headers["content-disposition"] == "attachment; filename*=utf-8''Laufr%C3%A4d.glb"


def test_the_bom_names_its_product_and_is_not_sent_twice(client, product_id, design_id, finish):
    finish(design_id, operations=[{"id": "a"}, {"id": "b"}])
    client.patch(f"/api/v1/products/{product_id}", json={"external_ids": {"plm": "1"}})
    url = f"/api/v1/designs/{design_id}/bom"

    tags = {}
    for accept in ("application/json", "text/csv", XLSX):
        answer = client.get(url, headers={"Accept": accept})
        tags[accept] = answer.headers["ETag"]
        assert client.get(url, headers={"Accept": accept, "If-None-Match": tags[accept]}).status_code == 304

    assert len(set(tags.values())) == 3
    product = client.get(url).json()["product"]
    assert (product["id"], product["external_ids"]) == (product_id, {"plm": "1"})
