import pytest
from sqlalchemy import text

from gripwright.store.models import ProductRow
from service_factory import make_document, make_package, new_part_number, store_product

PRODUCTS = "/api/v1/products"
IDS = {"plm": "4711:A", "erp.sap": "10-Ä"}
MERGE = {"content-type": "application/merge-patch+json"}


def named(ids=IDS, **fields):
    document = make_document(external_ids=ids, **fields)
    document["components"][0]["external_ids"] = {"plm": "4712"}
    return document


def upload(client, document):
    return client.post(PRODUCTS, files={"package": ("package.zip", make_package(document))})


def test_a_product_and_its_components_say_what_other_systems_call_them(client):
    created = upload(client, named())

    assert created.status_code == 201, created.text
    read = client.get(created.headers["Location"]).json()
    assert read["external_ids"] == IDS
    assert [component["external_ids"] for component in read["components"]] == [{"plm": "4712"}, {}]


def test_names_of_other_systems_are_no_content_and_a_second_upload_leaves_them(client, service):
    document = named()
    first = upload(client, document).json()

    again = upload(client, {**document, "external_ids": {"plm": "other"}})

    assert again.status_code == 200
    assert again.json() == first
    with service.database.read_sessions() as session:
        row = session.get(ProductRow, first["id"])
        assert row.content_sha256 == row.task_sha256
        assert "4711" not in service.artifacts.get(row.task_sha256).decode("latin-1")


def test_a_product_is_found_by_the_name_that_another_system_gives_it(client, service):
    key = new_part_number()
    ids = [
        store_product(service.database, service.artifacts, make_document(external_ids={"plm": key, "erp": "x"})) for _ in range(2)
    ]
    store_product(service.database, service.artifacts, make_document(external_ids={"erp": key}))

    found = client.get(PRODUCTS, params={"external_id": f"plm:{key}"}).json()["items"]

    assert [item["id"] for item in found] == ids
    with service.database.read_engine.connect() as connection:
        query = "EXPLAIN QUERY PLAN SELECT product_id FROM external_id WHERE system = 'a' AND value = 'b'"
        assert "USING INDEX ix_external_id_system_value" in str(connection.execute(text(query)).all())


def test_a_patch_merges_names_and_changes_no_design(client, service):
    created = upload(client, named())
    url, tag = created.headers["Location"], created.headers["ETag"]
    with service.database.read_sessions() as session:
        before = session.get(ProductRow, created.json()["id"]).task_sha256

    patched = client.patch(url, json={"external_ids": {"plm": None, "mes": "7"}}, headers={**MERGE, "If-Match": tag})

    assert patched.status_code == 200, patched.text
    assert patched.json()["external_ids"] == {"erp.sap": "10-Ä", "mes": "7"}
    assert patched.headers["ETag"] == client.get(url).headers["ETag"] == '"2-gzip"'
    assert client.get(url).json() == patched.json()
    with service.database.read_sessions() as session:
        assert session.get(ProductRow, created.json()["id"]).task_sha256 == before
    assert client.get(PRODUCTS, params={"external_id": "mes:7"}).json()["items"][-1]["id"] == created.json()["id"]
    assert client.patch(url, json={"name": "New", "external_ids": None}).json()["external_ids"] == {}
    assert client.get(url).json()["name"] == "New"


def test_a_stale_patch_is_refused_and_changes_nothing(client, product_id, problem):
    url = f"{PRODUCTS}/{product_id}"
    before = client.get(url)

    problem(client.patch(url, json={"name": "x"}, headers={"If-Match": '"9"'}), 412, "precondition-failed")

    after = client.get(url)
    assert (after.headers["ETag"], after.json()) == (before.headers["ETag"], before.json())


@pytest.mark.parametrize(
    ("patch", "pointer"),
    [
        ({"part_number": "x"}, "/part_number"),
        ({"name": 5}, "/name"),
        ({"a/b": 5}, "/a~1b"),
        ({"external_ids": []}, "/external_ids"),
        ({"external_ids": {"plm": ""}}, "/external_ids/plm"),
        ({"external_ids": {"plm": {"id": "x"}}}, "/external_ids/plm"),
        ({"external_ids": {"p:m": "x"}}, "/external_ids/p:m"),
        ({"external_ids": {f"s{k}": "x" for k in range(21)}}, "/external_ids"),
    ],
)
def test_a_patch_of_a_product_that_cannot_be_is_refused_with_a_pointer(client, product_id, problem, patch, pointer):
    body = problem(client.patch(f"{PRODUCTS}/{product_id}", json=patch, headers=MERGE), 422, "invalid-input")

    assert [error["pointer"] for error in body["errors"]] == [pointer]


def test_a_component_has_names_of_its_own_that_a_patch_merges(client):
    url = upload(client, named()).headers["Location"] + "/components/base"

    patched = client.patch(url, json={"external_ids": {"erp": "9"}}, headers=MERGE)

    assert patched.json()["external_ids"] == {"plm": "4712", "erp": "9"}


@pytest.mark.parametrize("media_type", ["application/json-patch+json", "text/plain", None])
def test_a_patch_of_another_type_is_told_which_are_taken(client, product_id, problem, media_type):
    headers = {} if media_type is None else {"content-type": media_type}

    for url in (f"{PRODUCTS}/{product_id}", f"{PRODUCTS}/{product_id}/components/rotor"):
        answer = client.patch(url, content=b"{}", headers=headers)

        problem(answer, 415, "unsupported-media-type")
        assert answer.headers["Accept-Patch"] == "application/merge-patch+json, application/json"
