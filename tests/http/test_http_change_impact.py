import pytest

from service_factory import make_document, store_product

GRIPPER = {
    "id": "G1",
    "gripper_type": "centric-3",
    "grip": "external",
    "opening_min": 10.0,
    "opening_max": 14.0,
    "finger_length": 30.0,
    "palm_radius": 40.0,
}


@pytest.fixture
def revision_id(service):
    return store_product(service.database, service.artifacts, make_document(revision="B"))


@pytest.fixture
def complete(jobs, service):
    """Ends a design whose one gripper does op-1."""

    def complete(design_id, actuator, owned=None):
        operation = {"id": "op-1", "status": "covered", "gripper": "G1", "detail": None, "owned_that_hold": [owned]}
        document = {
            "product": {"part_number": "P", "revision": "A"},
            "status": "complete",
            "operations": [operation],
            "components": [],
            "grippers": [{**GRIPPER, "actuator": actuator, "owned": owned}],
            "bom": [],
        }
        assert jobs.start(design_id, 1)
        jobs.finish(design_id, 1, "complete", document, {"bom.csv": service.artifacts.put(b"")})

    return complete


def test_a_revision_is_designed_with_the_grippers_at_hand_and_then_compared(
    client, product_id, revision_id, design_id, complete, any_actuator
):
    complete(design_id, any_actuator)
    url, body = f"/api/v1/products/{product_id}/change-impact", {"revision": revision_id}

    asked = client.post(url, json=body)

    assert (asked.status_code, asked.json()["status"], asked.json()["impact"]) == (202, "queued", None), asked.text
    assert asked.headers["Retry-After"] == "1"
    assert asked.json()["earlier_design"] == f"/api/v1/designs/{design_id}"
    design = client.get(asked.json()["design"]).json()
    assert (design["product_id"], [owned["name"] for owned in design["options"]["owned"]]) == (revision_id, ["P-A-G1"])
    assert client.post(url, json=body).json() == asked.json()

    complete(design["id"], any_actuator, owned="P-A-G1")
    answer = client.post(url, json=body)

    assert answer.status_code == 200
    assert answer.json()["impact"] == {
        "operations": [{"id": "op-1", "outcome": "held", "before": "P-A-G1", "after": "P-A-G1", "detail": None}],
        "grippers": [{"id": "G1", "name": "P-A-G1", "holds": ["op-1"], "no_longer_holds": []}],
        "new_grippers": [],
        "components": [],
    }


@pytest.fixture
def any_actuator(client):
    items = client.get("/api/v1/actuators", params={"limit": 200}).json()["items"]
    found = next(item for item in items if (item["stroke"] or 0) >= 4.0)
    return {"maker": found["maker"], "model": found["model"]}


def test_a_revision_whose_design_was_cancelled_is_no_answer(
    client, product_id, revision_id, design_id, complete, problem, any_actuator
):
    complete(design_id, any_actuator)
    url, body = f"/api/v1/products/{product_id}/change-impact", {"revision": revision_id}
    design = client.post(url, json=body).json()["design"].rsplit("/", 1)[1]
    client.post(f"/api/v1/jobs/{design}/cancel")

    problem(client.post(url, json=body), 409)


def test_what_cannot_be_compared_is_refused(client, product_id, revision_id, problem):
    url = f"/api/v1/products/{product_id}/change-impact"

    problem(client.post(url, json={"revision": revision_id}), 409)
    problem(client.post(url, json={"revision": "none"}), 404)
    problem(client.post("/api/v1/products/none/change-impact", json={"revision": revision_id}), 404)
    problem(client.post(url, json={"revision": product_id}), 422)
    problem(client.post(url, json={}), 422)


@pytest.mark.parametrize(
    ("owned", "pointer"),
    [
        ([{"name": "a"}], "/options/owned/0/gripper_type"),
        (
            [{"name": "a", "gripper_type": "x-2", "opening_min": 0, "opening_max": 1, "finger_length": 9, "actuator": "A/b"}],
            "/options/owned/0/actuator",
        ),
    ],
)
def test_grippers_at_hand_that_cannot_be_are_refused_at_their_place(client, product_id, problem, owned, pointer):
    body = problem(client.post(f"/api/v1/products/{product_id}/designs", json={"options": {"owned": owned}}), 422)

    assert pointer in [error["pointer"] for error in body["errors"]]
