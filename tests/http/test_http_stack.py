"""What stands around the routes, together: keys, waiting, encodings, conditions, HEAD, limits, the trail and the figures."""

import gzip
import threading
import time

import pytest
from key_factory import bearer
from prometheus_client.parser import text_string_to_metric_families

from gripwright.domain.access import AccessScope
from gripwright.store.columns import new_id, utc_now
from service_factory import make_document, make_package, store_product

API = "/api/v1"
GZIP, PLAIN = {"Accept-Encoding": "gzip"}, {"Accept-Encoding": "identity"}
VARYING = ("date", "x-request-id", "ratelimit")


@pytest.fixture
def key():
    return {"Idempotency-Key": new_id(utc_now())}


def raw(client, method, path, **request):
    """The answer with its body as it was sent."""
    with client.stream(method, path, **request) as answer:
        return answer, b"".join(answer.iter_raw())


def lasting(answer):
    return {name: value for name, value in answer.headers.items() if name not in VARYING}


@pytest.mark.parametrize("encoding", [GZIP, PLAIN], ids=["gzip", "plain"])
def test_head_has_the_headers_of_get_whatever_is_accepted(client, design_id, product_id, finish, encoding):
    finish(design_id, files={"part.stl": b"solid\n" * 1000}.items())
    paths = [
        f"{API}/actuators",
        f"{API}/products/{product_id}",
        f"{API}/designs/{design_id}",
        f"{API}/designs/{design_id}/bom",
        f"{API}/designs/{design_id}/files/part.stl",
        f"{API}/designs/{design_id}/package.zip",
        f"{API}/products/none",
        "/openapi.json",
        "/",
    ]

    for path in paths:
        got, _ = raw(client, "GET", path, headers=encoding)
        head, body = raw(client, "HEAD", path, headers=encoding)

        assert (head.status_code, lasting(head)) == (got.status_code, lasting(got)), path
        assert body == b""


def test_what_is_known_is_known_to_head_and_caches_learn_what_it_depends_on(client, product_id):
    path = f"{API}/products/{product_id}"

    for encoding, tag in ((GZIP, '"1-gzip"'), (PLAIN, '"1"')):
        for method in ("GET", "HEAD"):
            answer = client.request(method, path, headers={**encoding, "If-None-Match": tag})

            assert (answer.status_code, answer.headers["ETag"], answer.headers["Vary"]) == (304, tag, "Accept-Encoding")


def test_an_answer_that_is_given_again_is_encoded_for_whoever_takes_it(client, key):
    files = {"package": ("p.zip", make_package(make_document()))}
    first, packed = raw(client, "POST", f"{API}/products", files=files, headers={**key, **GZIP})

    again, packed_again = raw(client, "POST", f"{API}/products", files=files, headers={**key, **GZIP})
    plain, body = raw(client, "POST", f"{API}/products", files=files, headers={**key, **PLAIN})

    assert (first.status_code, again.status_code, plain.status_code) == (201, 201, 201)
    assert (first.headers["ETag"], again.headers["ETag"], plain.headers["ETag"]) == ('"1-gzip"', '"1-gzip"', '"1"')
    assert packed_again == packed
    assert gzip.decompress(packed) == body
    assert again.headers["Content-Length"] == str(len(packed))
    assert "Content-Encoding" not in plain.headers
    assert {again.headers["Vary"], plain.headers["Vary"]} == {"Accept-Encoding"}


@pytest.fixture
def finish_soon(client, finish, product_id):
    """Ends the queued design of the product once it is there."""
    url = f"{API}/products/{product_id}/designs?status=queued"

    def run():
        deadline = time.monotonic() + 20
        while not (items := client.get(url).json()["items"]):
            assert time.monotonic() < deadline
            time.sleep(0.02)
        finish(items[0]["id"])

    thread = threading.Thread(target=run)
    yield thread.start
    thread.join()


def test_who_waits_under_a_key_gets_the_design_and_gets_it_again(client, product_id, key, finish_soon, service):
    url, headers = f"{API}/products/{product_id}/designs", {**key, **GZIP, "Prefer": "wait=20"}
    finish_soon()

    first = client.post(url, json={}, headers=headers)
    again = client.post(url, json={}, headers=headers)
    unwaited = client.post(url, json={}, headers=key)

    assert (first.status_code, again.status_code, unwaited.status_code) == (201, 201, 202)
    assert again.json() == first.json() == client.get(first.headers["Location"]).json()
    assert first.headers["Location"] == again.headers["Location"] == unwaited.headers["Location"]
    assert [answer.headers.get("Idempotency-Replayed") for answer in (first, again, unwaited)] == [None, "true", "true"]
    assert again.headers["Preference-Applied"] == "wait=20"
    assert len(client.get(url).json()["items"]) == 1
    assert client.get(f"{API}/products", headers={"Prefer": "wait=1"}).status_code == 200


def test_nothing_is_posted_where_anybody_may_ask_under_a_key_or_not(client, problem, key):
    answers = [client.post("/health/live", headers=key), client.post("/health/live")]

    assert [problem(answer, 405)["detail"] for answer in answers] == ["there is no POST /health/live"] * 2
    assert {answer.headers["Allow"] for answer in answers} == {"GET, HEAD, OPTIONS"}


@pytest.mark.parametrize("path", ["/products", "/products?dry_run=true", "/products/import", "/products/import?dry_run=true"])
def test_uploads_may_be_as_large_as_uploads_may_be_and_other_bodies_as_other_bodies(client, problem, service, key, path):
    upload, other = service.settings.upload_max_bytes, service.settings.body_max_bytes
    fits, too_large = ({"package": ("p.zip", b"x" * size)} for size in (upload - 1000, upload))

    taken = client.post(API + path, files=fits)
    refused = client.post(API + path, files=too_large)

    assert taken.status_code in (200, 422), taken.text
    problem(refused, 413, "limit-exceeded")
    problem(client.post(f"{API}/gripper-sets", content=iter([b"{", b" " * other])), 413, "limit-exceeded")
    problem(client.post(f"{API}/gripper-sets", content=iter([b"{", b" " * other]), headers=key), 413, "limit-exceeded")
    problem(client.post(f"{API}/gripper-sets", content=b"x" * (other + 1)), 413, "limit-exceeded")
    problem(client.post(f"{API}/actuators/import", content=b"x" * (other + 1)), 413, "limit-exceeded")


def test_each_answer_to_a_change_is_in_the_trail_once_with_what_it_was_about(closed, keys):
    service, admin, reader = closed.service, bearer(keys[AccessScope.ADMIN]), bearer(keys[AccessScope.READ])
    product_id = store_product(service.database, service.artifacts)
    designs, key = f"{API}/products/{product_id}/designs", {"Idempotency-Key": new_id(utc_now())}
    asked = [
        ("POST", designs, {**admin, **key}, b"{}"),
        ("POST", designs, {**admin, **key}, b"{}"),  # again
        ("POST", designs, {**admin, **key}, b"[]"),  # another
        ("POST", designs, {**admin, "Content-Encoding": "gzip"}, b"{}"),
        ("POST", designs, admin, b" " * (service.settings.body_max_bytes + 1)),
        ("DELETE", f"{API}/products/{product_id}", {**admin, "If-Match": '"7-gzip"'}, b""),
        ("DELETE", f"{API}/products/{product_id}", reader, b""),
        ("PUT", f"{API}/products/{product_id}", admin, b""),
    ]

    answers = [
        closed.request(method, path, headers={"Content-Type": "application/json", **headers}, content=body)
        for method, path, headers, body in asked
    ]

    assert [answer.status_code for answer in answers] == [202, 202, 422, 415, 413, 412, 403, 405]
    assert answers[1].json() == answers[0].json()
    rows = closed.get(f"{API}/audit", params={"limit": len(asked)}, headers=admin).json()["items"][::-1]
    design_id = answers[0].json()["id"]
    about = [design_id] * 2 + [product_id] * 6
    assert [(row["method"], row["path"], row["status"], row["resource_id"]) for row in rows] == [
        (method, path, answer.status_code, resource)
        for (method, path, _, _), answer, resource in zip(asked, answers, about, strict=True)
    ]
    assert [row["request_id"] for row in rows] == [answer.headers["X-Request-ID"] for answer in answers]


def counts(client, headers):
    """(method, route, status) → how many were answered so far."""
    families = text_string_to_metric_families(client.get("/metrics", headers=headers).text)
    samples = (sample for family in families for sample in family.samples if sample.name == "gripwright_http_requests_total")
    return {tuple(sample.labels[name] for name in ("method", "route", "status")): sample.value for sample in samples}


def test_each_answer_is_counted_under_its_route_wherever_it_was_given(closed, keys):
    service, admin, reader = closed.service, bearer(keys[AccessScope.ADMIN]), bearer(keys[AccessScope.READ])
    product_id = store_product(service.database, service.artifacts)
    designs, key = f"{API}/products/{product_id}/designs", {"Idempotency-Key": new_id(utc_now())}
    file = f"{API}/designs/{new_id(utc_now())}/files/a/b.step"
    before = counts(closed, admin)

    closed.post(designs, json={}, headers={**admin, **key})
    closed.post(designs, json={}, headers={**admin, **key, "Prefer": "wait=0"})
    closed.post(designs, json={}, headers=reader)
    closed.post(designs, json={})
    closed.post(designs, content=b"", headers={**admin, "Content-Encoding": "br"})
    closed.head(f"{API}/products/{product_id}", headers={**admin, **GZIP})
    closed.get(f"{API}/jobs/none", headers={**admin, "Prefer": "wait=1"})
    closed.get(file, headers=admin)
    closed.put(f"{API}/products", headers=admin)
    closed.get("/nowhere/%00", headers=admin)

    after = counts(closed, admin)
    requested, product = "/products/{product_id}/designs", "/products/{product_id}"
    assert {labels: count - before.get(labels, 0) for labels, count in after.items() if count != before.get(labels, 0)} == {
        ("POST", requested, "202"): 2,
        ("POST", requested, "403"): 1,
        ("POST", requested, "401"): 1,
        ("POST", requested, "415"): 1,
        ("HEAD", product, "200"): 1,
        ("GET", "/jobs/{job_id}", "404"): 1,
        ("GET", "/designs/{design_id}/files/{path:path}", "404"): 1,
        ("PUT", "/products", "405"): 1,
        ("GET", "", "400"): 1,
        ("GET", "/metrics", "200"): 1,
    }
