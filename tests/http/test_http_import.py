import io
import zipfile

import pytest

from service_factory import make_document, make_package

PRODUCTS = "/api/v1/products"


def archive(**files):
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w") as opened:
        for name, data in files.items():
            opened.writestr(name.replace("__", "."), data)
    return target.getvalue()


def send(client, *files, **query):
    parts = [("package", (name, data, "application/octet-stream")) for name, data in files]
    return client.post(f"{PRODUCTS}/import", files=parts, params=query)


def numbers(client, document):
    return client.get(PRODUCTS, params={"part_number": document["part_number"]}).json()["items"]


@pytest.fixture
def mixed(client):
    """A new package, one that exists, one that conflicts, and one that is faulty."""
    new, known, other, faulty = (make_document() for _ in range(4))
    for document in (known, other):
        assert client.post(PRODUCTS, files={"package": ("p.zip", make_package(document))}).status_code == 201
    faulty["components"][1]["file"] = "missing.stl"
    files = [
        ("faulty.zip", make_package(faulty)),
        ("new.zip", make_package(new)),
        ("known.zip", make_package(known)),
        ("other.zip", make_package(other, size_mm=11.0)),
    ]
    return new, known, faulty, files


OUTCOMES = ["refused", "created", "exists", "conflict"]


def test_one_bad_package_does_not_lose_the_others(client, mixed):
    new, known, faulty, files = mixed

    answer = send(client, *files)

    assert answer.status_code == 200, answer.text
    items = answer.json()["items"]
    assert [item["name"] for item in items] == [name for name, _ in files]
    assert [item["outcome"] for item in items] == OUTCOMES
    assert [error["pointer"] for error in items[0]["errors"]] == ["/components/1/file"]
    assert client.get(f"{PRODUCTS}/{items[1]['product_id']}").json()["part_number"] == new["part_number"]
    assert items[2]["product_id"] == numbers(client, known)[0]["id"]
    assert "other content" in items[3]["detail"]
    assert numbers(client, faulty) == []


def test_a_dry_run_says_the_same_and_stores_nothing(client, mixed, service):
    new, _, _, files = mixed
    before = {path for path in (service.settings.data_dir / "artifacts").rglob("*") if path.is_file()}

    answer = send(client, *files, dry_run=True)

    assert answer.json()["dry_run"] is True
    assert [item["outcome"] for item in answer.json()["items"]] == OUTCOMES
    assert answer.json()["items"][1]["product_id"] is None
    assert numbers(client, new) == []
    assert {path for path in (service.settings.data_dir / "artifacts").rglob("*") if path.is_file()} == before


def test_a_dry_run_of_the_same_number_with_two_contents_says_which_would_be_refused(client):
    document = make_document()

    same, other = make_package(document), make_package(document, size_mm=11.0)
    items = send(client, ("a.zip", same), ("b.zip", other), ("c.zip", same), dry_run=True).json()["items"]

    assert [item["outcome"] for item in items] == ["created", "conflict", "exists"]


def test_packages_may_come_in_an_archive_together(client):
    first, second = make_document(), make_document()
    bundle = archive(a__zip=make_package(first), b__zip=make_package(second), c__txt=b"hello", d__zip=b"no archive")

    items = send(client, ("all.zip", bundle)).json()["items"]

    assert [(item["name"], item["outcome"]) for item in items] == [
        ("all.zip/a.zip", "created"),
        ("all.zip/b.zip", "created"),
        ("all.zip/c.txt", "refused"),
        ("all.zip/d.zip", "refused"),
    ]
    assert len(numbers(client, first)) == len(numbers(client, second)) == 1


def test_archives_in_archives_in_archives_are_refused(client):
    inner = archive(a__zip=make_package(make_document()))

    (item,) = send(client, ("all.zip", archive(inner__zip=inner))).json()["items"]

    assert item["outcome"] == "refused"
    assert item["errors"][0]["message"] == "an archive inside the archive"


def test_an_import_has_limits_and_a_form(client, problem):
    package = make_package(make_document())

    problem(send(client, *[(f"{k}.zip", package) for k in range(6)]), 413, "limit-exceeded")
    problem(send(client, ("big.zip", bytes(300_000))), 413, "limit-exceeded")
    problem(client.post(f"{PRODUCTS}/import", json={}), 415)
    problem(client.post(f"{PRODUCTS}/import", files={"manifest": (None, "{}")}), 422)


def test_a_dry_run_of_one_upload_says_what_would_be_done_and_does_nothing(client, problem):
    document = make_document()

    def dry_run(size_mm=10.0):
        files = {"package": ("p.zip", make_package(document, size_mm=size_mm))}
        return client.post(PRODUCTS, files=files, params={"dry_run": True})

    first = dry_run()
    assert (first.status_code, first.json()["outcome"], first.json()["product_id"]) == (200, "created", None)
    assert numbers(client, document) == []
    created = client.post(PRODUCTS, files={"package": ("p.zip", make_package(document))}).json()
    assert dry_run().json()["product_id"] == created["id"]
    problem(dry_run(size_mm=11.0), 409, "conflict")
