from datetime import timedelta

import pytest

from gripwright.store.columns import utc_now
from gripwright.store.models import ProductRow
from service_factory import make_document, new_part_number, store_product

API = "/api/v1"


@pytest.fixture
def family(service):
    """A part number with five revisions, and their ids."""
    number = new_part_number()
    return number, [
        store_product(service.database, service.artifacts, make_document(number, revision=letter)) for letter in "ABCDE"
    ]


def pages(client, url):
    """The items of every page, and the first page."""
    items, first = [], None
    while url is not None:
        answer = client.get(url)
        assert answer.status_code == 200, answer.text
        first = first or answer.json()
        items += answer.json()["items"]
        url = answer.links["next"]["url"] if "next" in answer.links else None
    return items, first


def test_a_sync_sees_what_changes_while_it_reads_and_what_changes_after_it(client, family):
    number, ids = family
    since = utc_now() - timedelta(days=1)
    url = f"{API}/products?part_number={number}&limit=2&updated_since={since.isoformat().replace('+', '%2B')}"
    first = client.get(url)
    client.patch(f"{API}/products/{ids[0]}", json={"name": "changed on the way"})

    rest, _ = pages(client, first.links["next"]["url"])

    assert [item["id"] for item in first.json()["items"]] == ids[:2]
    assert [item["id"] for item in rest] == [*ids[2:], ids[0]]
    assert "changed on the way" in {item["name"] for item in rest}
    client.patch(f"{API}/products/{ids[3]}", json={"name": "changed after it"})
    again, _ = pages(
        client, f"{API}/products?part_number={number}&updated_since={first.json()['next_updated_since'].replace('+', '%2B')}"
    )
    assert "changed after it" in {item["name"] for item in again}


def test_what_did_not_change_since_then_is_left_out(client, family, service):
    number, ids = family
    with service.database.write_sessions.begin() as session:
        for product_id in ids[:4]:
            session.get(ProductRow, product_id).updated_at = utc_now() - timedelta(days=2)

    items, first = pages(
        client, f"{API}/products?part_number={number}&updated_since={(utc_now() - timedelta(days=1)):%Y-%m-%dT%H:%M:%SZ}"
    )

    assert [item["id"] for item in items] == ids[4:]
    assert first["next_updated_since"] is not None
    assert client.get(f"{API}/products", params={"part_number": number, "revision": "B"}).json()["items"][0]["id"] == ids[1]


@pytest.mark.parametrize(
    "word", ["yesterday", "2026-01-01", "2026-01-01T00:00:00", "0", "2026-13-01T00:00:00Z", "0001-01-01T00:00:00+14:00"]
)
@pytest.mark.parametrize("path", ["products", "designs", "jobs"])
def test_a_moment_that_is_none_is_refused_with_its_pointer(client, problem, path, word):
    body = problem(client.get(f"{API}/{path}", params={"updated_since": word}), 422)

    assert [error["pointer"] for error in body["errors"]] == ["/query/updated_since"]


def test_designs_and_jobs_are_listed_by_what_became_of_them_and_when_they_changed(client, product_id, finish, jobs):
    url = f"{API}/products/{product_id}/designs"
    first, second, third = (client.post(url, json={}).json()["id"] for _ in range(3))
    finish(first, "incomplete")
    finish(second)

    def listed(**query):
        return [item["id"] for item in client.get(f"{API}/designs", params={"product_id": product_id, **query}).json()["items"]]

    assert listed() == [third, second, first]
    assert listed(status="incomplete") == [first]
    assert listed(status="complete") == [second]
    assert listed(status="queued") == [third]
    changed = {"product_id": product_id, "updated_since": "2020-01-01T00:00:00Z", "limit": 1}
    jobs.start(third, 1)
    in_order = [first, second, third]
    for path in (f"{API}/designs", f"{API}/jobs"):
        query = "&".join(f"{key}={value}" for key, value in changed.items())
        assert [item["id"] for item in pages(client, f"{path}?{query}")[0]] == in_order
    assert [item["id"] for item in client.get(url).json()["items"]] == [third, second, first]
    client.post(f"{API}/jobs/{third}/cancel")
    item = client.get(url, params={"status": "running"}).json()["items"][0]
    assert item["updated_at"] > item["created_at"]


def test_designs_of_no_product_are_not_found(client, problem):
    problem(client.get(f"{API}/products/none/designs"), 404, "not-found")


def test_only_the_fields_that_are_asked_for_are_sent(client, product_id, design_id):
    def read(path, fields):
        return client.get(f"{API}/{path}", params={"fields": fields}).json()

    assert read(f"products/{product_id}", "id,name") == {"id": product_id, "name": "Pump"}
    assert set(read(f"designs/{design_id}", " status , id")) == {"id", "status"}
    assert set(read(f"jobs/{design_id}", "progress")) == {"progress"}
    assert [set(item) for item in read(f"products/{product_id}/components", "id,faces")["items"]] == [{"id", "faces"}] * 2
    for path in ("products", "designs", "jobs"):
        page = read(path, "id")
        assert set(page) == {"items", "next_cursor", "next_updated_since"}
        assert {tuple(item) for item in page["items"]} == {("id",)}


@pytest.mark.parametrize(
    "path", ["products", "designs", "jobs", "actuators", "products/{product}", "designs/{design}", "jobs/{design}"]
)
@pytest.mark.parametrize("fields", ["id,colour", "", "id,,name"])
def test_a_field_that_there_is_not_is_refused_with_its_pointer(client, problem, product_id, design_id, path, fields):
    url = f"{API}/{path.format(product=product_id, design=design_id)}"

    body = problem(client.get(url, params={"fields": fields}), 422, "invalid-input")

    assert [error["pointer"] for error in body["errors"]] == ["/query/fields"]


@pytest.mark.parametrize(
    "path",
    [
        "products?part_number=none",
        "products/{product}",
        "products/{product}/components",
        "products/{product}/components/rotor",
        "products/{product}/designs",
        "designs/{design}",
        "designs?product_id={product}",
        "jobs/{design}",
        "jobs?product_id={product}",
        "plugins",
        "plugins/segmenter/sdf",
        "actuators",
        "actuators/SMC/MHSL3-32D (as in paper)",
    ],
)
def test_what_has_not_changed_is_not_sent_again(client, product_id, design_id, path):
    url = f"{API}/{path.format(product=product_id, design=design_id)}"
    first = client.get(url)
    assert first.status_code == 200, first.text

    again = client.get(url, headers={"If-None-Match": f'"x", {first.headers["ETag"]}'})
    other = client.get(url, headers={"If-None-Match": '"x"'})

    assert (again.status_code, again.content) == (304, b"")
    assert again.headers["ETag"] == first.headers["ETag"]
    assert other.status_code == 200


def test_a_design_that_went_on_is_sent_again(client, design_id, jobs):
    url = f"{API}/designs/{design_id}"
    tag = client.get(url).headers["ETag"]

    jobs.start(design_id, 1)

    answer = client.get(url, headers={"If-None-Match": tag})
    assert answer.status_code == 200
    assert answer.json()["status"] == "running"


def test_an_actuator_that_was_deleted_and_put_anew_has_another_tag(client):
    url = f"{API}/actuators/Acme/{new_part_number()}"
    figures = {"gripper_type": "centric-3", "stroke": 10}
    first = client.put(url, json=figures)
    client.delete(url, headers={"If-Match": first.headers["ETag"]})

    second = client.put(url, json={**figures, "stroke": 11})

    assert client.get(url, headers={"If-None-Match": first.headers["ETag"]}).json()["stroke"] == 11
    assert client.delete(url, headers={"If-Match": first.headers["ETag"]}).status_code == 412
    assert client.delete(url, headers={"If-Match": second.headers["ETag"]}).status_code == 204
