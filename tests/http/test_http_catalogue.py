import json
import time
from pathlib import Path

import jsonschema
import pytest

from gripwright.cli.openapi import openapi_document

FIGURES = {"gripper_type": "parallel-2", "stroke": 12.0, "grip_force": 40.0}


def test_the_catalogue_begins_with_published_actuators(client):
    items = client.get("/api/v1/actuators").json()["items"]

    assert {("SMC", "MHF2-12D2"), ("SMC", "MHSL3-32D (as in paper)")} <= {(item["maker"], item["model"]) for item in items}
    assert len(items) >= 85


def test_conflicts_and_unknown_figures_are_shown_as_such(client):
    items = {f"{item['maker']}/{item['model']}": item for item in client.get("/api/v1/actuators").json()["items"]}

    angular, conflicting, usable = items["SMC/MHC2-6"], items["SMC/MHSL3-32D (as in paper)"], items["SMC/MHZ2-16D"]

    assert (angular["stroke"], angular["grip_force"]) == (None, None)
    assert "is not known" in angular["not_used"]
    assert (conflicting["confidence"], conflicting["stroke"]) == ("C", 8.0)
    assert "conflict" in conflicting["not_used"]
    assert (usable["stroke"], usable["mass"], usable["not_used"]) == (6.0, None, None)


def test_an_actuator_is_added_replaced_and_deleted(client, problem):
    url = "/api/v1/actuators/ACME/G%201/b"

    created = client.put(url, json=FIGURES)
    replaced = client.put(url, json={**FIGURES, "stroke": 14}, headers={"If-Match": created.headers["ETag"]})

    assert created.status_code == 201
    assert (created.json()["maker"], created.json()["model"]) == ("ACME", "G 1/b")
    assert replaced.status_code == 200
    assert client.get(url).json() == replaced.json()
    assert replaced.json()["stroke"] == 14
    problem(client.put(url, json=FIGURES, headers={"If-Match": created.headers["ETag"]}), 412)
    problem(client.delete(url, headers={"If-Match": '"77"'}), 412)
    assert client.delete(url).status_code == 204
    problem(client.get(url), 404)
    problem(client.delete(url), 404)
    problem(client.put(url, json=FIGURES, headers={"If-Match": "*"}), 412)


OWN_CSV = """maker,model,type,fingers,stroke_mm,stroke_basis,grip_force_N,force_basis,opening_min_mm,opening_max_mm
Acme,C-12,centric,3,5,per-jaw,40,per jaw,,
Acme,C-12 on diameter,centric,3,10,diameter,120,sum of jaws,,
Acme,P-2,parallel,2,48,,,,0,30
"""


def import_csv(client, text, query="", media_type="text/csv"):
    return client.post(f"/api/v1/actuators/import{query}", content=text, headers={"content-type": media_type})


def test_actuators_are_imported_as_totals_whatever_basis_the_maker_states(client):
    answer = import_csv(client, OWN_CSV)

    assert answer.status_code == 200, answer.text
    per_jaw, on_diameter, conflicting = answer.json()["items"]
    assert (per_jaw["stroke"], per_jaw["grip_force"]) == (on_diameter["stroke"], on_diameter["grip_force"]) == (10.0, 120.0)
    assert (conflicting["confidence"], conflicting["note"]) == ("C", "CONFLICT: stroke 48 mm, opening 0 to 30 mm")
    assert client.get("/api/v1/actuators/Acme/C-12").json()["stroke"] == 10.0
    assert {item["outcome"] for item in answer.json()["items"]} == {"added"}
    assert {item["outcome"] for item in import_csv(client, OWN_CSV).json()["items"]} == {"unchanged"}
    changed = import_csv(client, OWN_CSV.replace("Acme,P-2,parallel,2,48", "Acme,P-2,parallel,2,30")).json()["items"]
    assert [item["outcome"] for item in changed] == ["unchanged", "unchanged", "replaced"]


def test_a_dry_run_says_what_an_import_would_do_and_does_nothing(client, problem):
    faulty = OWN_CSV.replace("Acme", "Beta") + "Beta,X,parallel,two,10,,,,,\n"

    answer = import_csv(client, faulty, "?dry_run=true")

    assert [item["outcome"] for item in answer.json()["items"]] == ["added"] * 3
    assert [error["pointer"] for error in answer.json()["errors"]] == ["/3/fingers"]
    problem(client.get("/api/v1/actuators/Beta/C-12"), 404)
    assert problem(import_csv(client, faulty), 422)["errors"][0]["pointer"] == "/3/fingers"
    problem(client.get("/api/v1/actuators/Beta/C-12"), 404)


def test_what_is_no_csv_of_actuators_is_refused(client, problem):
    problem(import_csv(client, "a,b\n1,2\n"), 422)
    problem(import_csv(client, b"\xff\xfe"), 422)
    problem(import_csv(client, "\r\r"), 422)
    problem(import_csv(client, OWN_CSV, media_type="application/json"), 415)


@pytest.mark.parametrize(
    ("change", "pointer"), [({"stroke": -1}, "/stroke"), ({"stroke": None}, "/stroke"), ({"colour": "red"}, "/colour")]
)
def test_figures_that_cannot_be_are_refused(client, problem, change, pointer):
    body = problem(client.put("/api/v1/actuators/ACME/bad", json={**FIGURES, **change}), 422)

    assert body["errors"][0]["pointer"] == pointer


def test_plugins_are_listed_with_a_valid_schema_of_their_options(client, problem):
    items = client.get("/api/v1/plugins").json()["items"]

    assert ("optimizer", "set_cover") in {(item["kind"], item["name"]) for item in items}
    for item in items:
        jsonschema.Draft202012Validator.check_schema(item["options"])
        assert client.get(f"/api/v1/plugins/{item['kind']}/{item['name']}").json() == item
        assert item["warnings"] == []
    problem(client.get("/api/v1/plugins/segmenter/none"), 404)


def test_the_schema_of_a_plan_says_which_options_choose_plugins_of_which_kind(client):
    answer = client.get("/api/v1/plugins").json()

    jsonschema.Draft202012Validator.check_schema(answer["plan"])
    chosen = {name: field["x-plugins"] for name, field in answer["plan"]["properties"].items() if "x-plugins" in field}
    assert set(chosen.values()) == set(KINDS)
    for name, kind in chosen.items():
        default = answer["plan"]["properties"][name]["default"]
        keys = {item["name"] for item in answer["items"] if item["kind"] == kind}
        assert {default} <= keys if isinstance(default, str) else set(default) <= keys


def test_a_gripper_set_is_minimised(client, problem):
    alternative = {"gripper_type": "centric-3", "opening_width": 124.9, "finger_length_min": 10, "finger_length_max": None}
    document = {
        "strokes": {"parallel-2": 48, "centric-3": 8},
        "release_clearance": 0,
        "components": [{"id": "1", "alternatives": [alternative]}],
    }

    answer = client.post("/api/v1/gripper-sets", json=document)

    assert answer.status_code == 200, answer.text
    assert answer.json()["proven"] is True
    assert answer.json()["grippers"][0]["opening_max"] == 124.9
    document["components"][0]["alternatives"][0]["opening_width"] = -1
    body = problem(client.post("/api/v1/gripper-sets", json=document), 422)
    assert body["errors"][0]["pointer"] == "/components/0/alternatives/0/opening_width"


def test_the_service_says_how_it_fares(client):
    assert client.get("/health/live").json() == {"status": "ok"}
    assert client.get("/health/ready").json() == {"status": "ok"}
    metrics = client.get("/metrics")
    assert metrics.headers["content-type"].startswith("text/plain")
    assert 'gripwright_jobs{status="queued"}' in metrics.text
    assert 'route="/health/live",status="200"' in metrics.text
    client.get("/api/v1/products/none")
    assert 'route="/products/{product_id}",status="404"' in client.get("/metrics").text
    client.request("BREW", "/health/live")
    assert 'method="other",route="/health/live",status="405"' in client.get("/metrics").text


def test_who_asks_whether_it_can_work_is_not_told_where_its_files_are(client, service, problem, monkeypatch):
    def full(name: str, data: bytes) -> None:
        raise OSError(28, "No space left on device", "/srv/secret")

    monkeypatch.setattr(service, "ready_s", 0.0)
    monkeypatch.setattr(service.artifacts.files, "refresh", full)
    time.sleep(1.1)

    body = problem(client.get("/health/ready"), 503)

    assert "secret" not in str(body)
    assert "log" in body["errors"][0]["message"]


def test_the_page_loads_nothing_from_elsewhere(client, problem):
    page = client.get("/")

    assert page.headers["content-type"].startswith("text/html")
    assert "default-src 'none'" in page.headers["content-security-policy"]
    for name in ("index.html", "app.js", "style.css"):
        text = (page if name == "index.html" else client.get(f"/dashboard/{name}")).text
        assert "http:" not in text
        assert "https:" not in text
    problem(client.get("/dashboard/none.js"), 404)


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [("GET", "/none", 404), ("GET", "/api/v1/none", 404), ("PATCH", "/api/v1/products", 405), ("POST", "/health/live", 405)],
)
def test_the_frameworks_own_errors_are_problems_too(client, problem, method, path, status):
    problem(client.request(method, path), status)


def test_a_method_that_is_not_allowed_is_answered_with_those_that_are(client, problem):
    answer = client.patch("/api/v1/actuators/SMC/MHF2-12D2")

    problem(answer, 405)
    assert answer.headers["Allow"] == "DELETE, GET, HEAD, OPTIONS, PUT"


def test_a_body_beyond_the_limit_is_refused(client, problem):
    problem(client.post("/api/v1/gripper-sets", content=b" " * 60_000, headers={"content-type": "application/json"}), 413)


def test_the_committed_openapi_document_is_this_versions():
    committed = json.loads((Path(__file__).parents[2] / "openapi" / "openapi.json").read_text())

    assert committed == openapi_document(), "run: gripwright openapi > openapi/openapi.json"


def references(node):
    """Every $ref in a document."""
    if isinstance(node, dict):
        found = [node["$ref"]] if isinstance(node.get("$ref"), str) else []
        return found + [ref for value in node.values() for ref in references(value)]
    return [ref for value in node for ref in references(value)] if isinstance(node, list) else []


def test_every_operation_has_a_stable_id_and_answers_errors_with_problems():
    document = openapi_document()
    assert not [ref for ref in references(document) if ref.rpartition("/")[2] not in document["components"]["schemas"]]
    operations = [operation for path in document["paths"].values() for operation in path.values()]

    ids = [operation["operationId"] for operation in operations]
    assert len(ids) == len(set(ids)) == 48
    for operation in operations:
        for status, answer in operation["responses"].items():
            if status >= "400":
                assert list(answer["content"]) == ["application/problem+json"], operation["operationId"]
