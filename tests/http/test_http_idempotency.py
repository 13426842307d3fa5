import asyncio
import hashlib
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from importlib import import_module
from pkgutil import iter_modules

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from key_factory import new_key
from sqlalchemy import func, select, text

from gripwright.domain.access import AccessScope
from gripwright.domain.errors import Conflict
from gripwright.http import routers
from gripwright.http.fingerprint import Fingerprint
from gripwright.http.idempotency import LEASE, ActingRoute
from gripwright.store.columns import new_id, utc_now
from gripwright.store.idempotency import IdempotencyRepository, KeptAnswer, KeyClaim
from gripwright.store.models import DesignRow, IdempotencyRow, WebhookRow
from service_factory import make_document, make_package

CSV = b"maker,model,type,fingers\nAcme,K-1,centric,3\n"
GRIPPER_SET = {"strokes": {"parallel-2": 10}, "components": [{"id": "a", "alternatives": []}]}
KEPT = ("content-type", "location", "etag", "retry-after")


@pytest.fixture
def key():
    return {"Idempotency-Key": new_id(utc_now())}


@pytest.fixture
def count(service):
    def count(row, *conditions):
        with service.database.read_sessions() as session:
            return session.scalar(select(func.count()).select_from(row).where(*conditions))

    return count


def claim_of_anybody(key):
    caller = hashlib.sha256(b"anonymous").hexdigest()
    return KeyClaim(caller_sha256=caller, key=key["Idempotency-Key"], id=new_id(utc_now()))


def assert_same(again, first):
    assert again.headers["Idempotency-Replayed"] == "true"
    assert "Idempotency-Replayed" not in first.headers
    assert (again.status_code, again.content) == (first.status_code, first.content)
    assert [again.headers.get(name) for name in KEPT] == [first.headers.get(name) for name in KEPT]


def test_an_upload_sent_again_is_answered_as_the_first_time_though_its_boundary_is_another(client, key):
    package = make_package(make_document())
    first = client.post("/api/v1/products", files={"package": ("p.zip", package)}, headers=key)

    again = client.post("/api/v1/products", files={"package": ("p.zip", package)}, headers=key)

    assert first.request.headers["content-type"] != again.request.headers["content-type"]
    assert first.status_code == 201
    assert_same(again, first)


@pytest.mark.parametrize(
    ("path", "request_"),
    [
        ("/api/v1/webhooks", {"json": {"url": "http://127.0.0.1:9/"}}),
        ("/api/v1/actuators/import", {"content": CSV, "headers": {"Content-Type": "text/csv"}}),
        ("/api/v1/gripper-sets", {"json": GRIPPER_SET}),
        ("/api/v1/products/none/designs", {"json": {}}),
        ("/api/v1/jobs/none/cancel", {}),
        ("/api/v1/webhooks", {"json": {"url": "no address"}}),
        ("/api/v1/webhooks", {"content": b"text", "headers": {"Content-Type": "text/plain"}}),
    ],
)
def test_whatever_is_posted_again_is_answered_as_the_first_time_refusals_too(client, key, path, request_):
    request_ = {**request_, "headers": {**request_.get("headers", {}), **key}}
    first = client.post(path, **request_)

    assert_same(client.post(path, **request_), first)


def test_a_job_is_retried_once_and_the_second_time_is_no_conflict(client, design_id, key):
    assert client.post(f"/api/v1/jobs/{design_id}/cancel").status_code == 202
    first = client.post(f"/api/v1/jobs/{design_id}/retry", headers=key)

    assert_same(client.post(f"/api/v1/jobs/{design_id}/retry", headers=key), first)
    assert client.post(f"/api/v1/jobs/{design_id}/retry").status_code == 409


def test_another_request_under_the_same_key_is_refused(client, product_id, problem, key):
    url = f"/api/v1/products/{product_id}/designs"
    assert client.post(url, json={"options": {"seed": 1}}, headers=key).status_code == 202

    problem(client.post(url, json={"options": {"seed": 2}}, headers=key), 422, "key-reused")
    problem(client.post(f"{url}?a=b", json={"options": {"seed": 1}}, headers=key), 422, "key-reused")
    problem(client.post("/api/v1/products/other/designs", json={"options": {"seed": 1}}, headers=key), 422, "key-reused")


def test_of_many_that_send_the_same_at_once_one_is_done(client, product_id, key, count):
    url = f"/api/v1/products/{product_id}/designs"

    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(lambda _: client.post(url, json={}, headers=key), range(24)))

    assert {answer.status_code for answer in answers} <= {202, 409}
    assert len({answer.json()["id"] for answer in answers if answer.status_code == 202}) == 1
    assert count(DesignRow, DesignRow.product_id == product_id) == 1


def test_while_the_first_is_answered_a_second_is_told_to_wait(client, service, product_id, problem, key):
    service.answers.claim(claim_of_anybody(key), utc_now())

    answer = client.post(f"/api/v1/products/{product_id}/designs", json={}, headers=key)

    problem(answer, 409, "request-in-flight")
    assert int(answer.headers["Retry-After"]) >= 1


def test_a_key_left_by_a_process_that_died_is_free_after_its_lease(client, service, product_id, key):
    service.answers.claim(claim_of_anybody(key), utc_now() - LEASE)

    assert client.post(f"/api/v1/products/{product_id}/designs", json={}, headers=key).status_code == 202


def test_who_was_taken_for_dead_and_is_not_has_no_effect(service, key):
    slow, other = claim_of_anybody(key), claim_of_anybody(key)
    service.answers.claim(slow, utc_now() - LEASE)
    service.answers.claim(other, utc_now())
    answer = KeptAnswer(request_sha256="0" * 64, status=201, headers=[], body=b"")

    def effect_and_answer():
        with service.database.write_sessions.begin() as session:
            session.add(
                WebhookRow(id=slow.id, url="", events=[], secret="", enabled=True, disabled_reason="", created_at=utc_now())
            )
            IdempotencyRepository(session).keep(slow, answer, utc_now() + LEASE)

    with pytest.raises(Conflict):
        effect_and_answer()

    with service.database.read_sessions() as session:
        assert session.get(WebhookRow, slow.id) is None


def test_effect_and_answer_are_stored_together_or_not_at_all(client, service, product_id, key, count):
    with service.database.write_engine.begin() as connection:
        connection.execute(
            text(
                "CREATE TRIGGER no_answers BEFORE UPDATE ON idempotency WHEN NEW.status < 400 "
                "BEGIN SELECT RAISE(ABORT, 'not kept'); END"
            )
        )
    try:
        answer = client.post(f"/api/v1/products/{product_id}/designs", json={}, headers=key)
    finally:
        with service.database.write_engine.begin() as connection:
            connection.execute(text("DROP TRIGGER no_answers"))

    assert answer.status_code == 409
    assert count(DesignRow, DesignRow.product_id == product_id) == 0


def test_a_failure_of_the_service_is_not_kept(client, service, product_id, problem, monkeypatch, key):
    url = f"/api/v1/products/{product_id}/designs"
    with monkeypatch.context() as broken:
        broken.setattr(service, "plugins", None)
        problem(client.post(url, json={}, headers=key), 503)

    assert client.post(url, json={}, headers=key).status_code == 202


def test_keys_belong_to_their_callers(closed, keys, problem):
    other = new_key(closed.service, "another", AccessScope.WRITE).word
    named, body = {"Idempotency-Key": "the same"}, {"url": "https://plm.example/1"}
    sent = [
        closed.post("/api/v1/gripper-sets", json=GRIPPER_SET, headers={**named, "Authorization": f"Bearer {word}"})
        for word in (keys[AccessScope.WRITE], other, other)
    ]

    assert [answer.headers.get("Idempotency-Replayed") for answer in sent] == [None, None, "true"]
    answer = closed.post("/api/v1/webhooks", json=body, headers={**named, "Authorization": f"Bearer {keys[AccessScope.READ]}"})
    problem(answer, 403)


def test_answers_are_forgotten_when_their_time_is_over(client, service, product_id, key, count):
    url = f"/api/v1/products/{product_id}/designs"
    client.post(url, json={}, headers=key)
    kept = IdempotencyRow.key == key["Idempotency-Key"]
    assert count(IdempotencyRow, kept) == 1

    service.answers.clear(utc_now() + timedelta(hours=25))

    assert count(IdempotencyRow, kept) == 0
    assert "Idempotency-Replayed" not in client.post(url, json={}, headers=key).headers


@pytest.mark.parametrize("word", ["", " ", "k" * 256, "\x01", '""'])
def test_a_key_that_cannot_be_one_is_refused(client, product_id, problem, word):
    answer = client.post(f"/api/v1/products/{product_id}/designs", json={}, headers={"Idempotency-Key": word})

    assert problem(answer, 422)["errors"][0]["pointer"] == "/header/Idempotency-Key"


def test_quotes_of_a_structured_field_do_not_count(client, product_id, key):
    url = f"/api/v1/products/{product_id}/designs"
    first = client.post(url, json={}, headers=key)

    assert_same(client.post(url, json={}, headers={"Idempotency-Key": f'"{key["Idempotency-Key"]}"'}), first)


def test_a_body_too_large_is_refused_under_a_key_too(client, problem, key):
    body = {"content": iter([b"x" * 60_000]), "headers": {"Content-Type": "text/csv", **key}}

    problem(client.post("/api/v1/actuators/import", **body), 413)


def test_every_post_can_be_repeated_under_a_key(app):
    modules = [import_module(f"{routers.__name__}.{module.name}") for module in iter_modules(routers.__path__)]
    posts = [route for module in modules for route in module.router.routes if "POST" in route.methods]

    documented = [operations["post"] for operations in app.openapi()["paths"].values() if "post" in operations]
    assert len(posts) == len(documented) >= 8
    assert [route.path for route in posts if not isinstance(route, ActingRoute)] == []
    for operation in documented:
        assert "Idempotency-Key" in [parameter["name"] for parameter in operation["parameters"]]


BOUNDARIES = st.text("ab", min_size=1, max_size=5)
PARTS = st.lists(st.text("xy-\r\n", max_size=30), min_size=1, max_size=4)


@given(BOUNDARIES, BOUNDARIES, PARTS, st.lists(st.integers(1, 9), min_size=1, max_size=40))
@settings(max_examples=200, deadline=None)
def test_the_hash_of_a_multipart_body_depends_on_its_parts_alone(first, second, parts, sizes):
    whole = digest(first, parts, [10_000])

    assert digest(second, parts, sizes) == whole
    assert digest(second, [*parts, "more"], sizes) != whole


def digest(boundary, parts, sizes):
    body = f"--{boundary}".join(["", *parts, "--\r\n"]).encode()
    chunks = []
    while body:
        size = sizes[len(chunks) % len(sizes)]
        chunks.append(body[:size])
        body = body[size:]
    messages = [{"type": "http.request", "body": chunk, "more_body": True} for chunk in chunks] + [{"type": "http.request"}]
    scope = {
        "type": "http",
        "method": "POST",
        "path": "/",
        "query_string": b"",
        "headers": [(b"content-type", f'multipart/form-data; boundary="{boundary}"'.encode())],
    }

    async def receive():
        return messages.pop(0)

    return asyncio.run(Fingerprint(scope, receive).digest())
