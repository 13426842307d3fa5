"""Who may do what where the service asks for a key."""

import asyncio
from datetime import timedelta

import pytest
from key_factory import bearer, new_key

from gripwright.cli.openapi import openapi_document
from gripwright.domain.access import AccessScope
from gripwright.domain.errors import Conflict
from gripwright.http.gate import require_way_in, required_scope
from gripwright.jobs.keys import create_key
from gripwright.settings import Settings
from gripwright.store.columns import utc_now
from gripwright.store.engines import Database
from gripwright.store.migrate import migrate
from service_factory import make_document, make_package, store_product

OPEN = {("GET", "/health/live"), ("GET", "/health/ready")}
ADMIN = {("GET", "/api/v1/audit")}
DOCUMENT = openapi_document()
ROUTES = [(method.upper(), path) for path, operations in DOCUMENT["paths"].items() for method in operations]


def expected_scope(method, path):
    """The rule in words: reading needs read, anything else write, the audit trail admin, and health nothing."""
    if (method, path) in OPEN:
        return None
    return "admin" if (method, path) in ADMIN else "read" if method == "GET" else "write"


def filled(path):
    """A path that leads to nothing: what is asked for is the scope, not the thing."""
    return path.replace("{", "no-").replace("}", "")


@pytest.mark.parametrize(("method", "path"), ROUTES)
def test_the_document_names_the_scope_of_each_route(method, path):
    operation = DOCUMENT["paths"][path][method.lower()]
    scope = expected_scope(method, path)

    assert operation["security"] == ([] if scope is None else [{"bearer": [scope]}])
    assert ("401" in operation["responses"]) is ("403" in operation["responses"]) is (scope is not None)


@pytest.mark.parametrize(("method", "path"), ROUTES)
def test_each_route_lets_in_the_scopes_that_it_should_and_no_other(closed, keys, problem, method, path):
    needed = expected_scope(method, path)

    for scope, word in keys.items():
        answer = closed.request(method, filled(path), headers=bearer(word))
        if needed is None or needed in [included.value for included in scope.included]:
            assert answer.status_code not in (401, 403), (scope, answer.text)
        else:
            body = problem(answer, 403, "scope-missing")
            assert f"the scope {needed} is missing" in body["detail"]
            assert f'error="insufficient_scope", scope="{needed}"' in answer.headers["WWW-Authenticate"]
    unsigned = closed.request(method, filled(path))
    if needed is None:
        assert unsigned.status_code != 401
    else:
        problem(unsigned, 401, "not-authenticated")
        assert unsigned.headers["WWW-Authenticate"] == 'Bearer realm="gripwright"'


@pytest.mark.parametrize(
    "path", ["/", "/dashboard/app.js", "/dashboard/access.js", "/openapi.json", "/health/live", "/health/ready"]
)
def test_what_is_the_same_everywhere_is_open(closed, path):
    assert closed.get(path).status_code == 200


@pytest.mark.parametrize("path", ["/api/v1/nothing", "//api/v1/jobs", "/docs", "/api/v1/jobs/", "/health", "/api/v1/%61udit"])
def test_a_path_that_nobody_thought_of_is_closed(closed, problem, path):
    problem(closed.get(path), 401)


@pytest.mark.parametrize("path", ["/api/v1/%61udit", "/api/v1/audit/", "/api/v1/audit?limit=1", "/api/v1/audit/x"])
def test_another_spelling_of_a_path_needs_no_lesser_scope(closed, keys, problem, path):
    problem(closed.get(path, headers=bearer(keys[AccessScope.WRITE]), follow_redirects=False), 403, "scope-missing")


@pytest.mark.parametrize("path", ["/dashboard/..%2Fapi%2Fv1%2Fjobs", "/dashboard/%2E%2E/%2E%2E/etc/passwd", "/dashboard//"])
def test_nothing_but_the_page_lies_in_its_open_folder(closed, problem, path):
    problem(closed.get(path), 404)


@pytest.mark.parametrize("method", ["HEAD", "OPTIONS", "TRACE"])
def test_no_method_is_forgotten(closed, keys, method):
    assert closed.request(method, "/api/v1/jobs").status_code == 401
    assert required_scope("TRACE", "/api/v1/jobs") is AccessScope.WRITE


def test_an_unsigned_upload_is_refused_before_it_is_read(closed):
    asked, answered = [], []
    scope = {"type": "http", "method": "POST", "path": "/api/v1/products", "raw_path": b"/api/v1/products", "query_string": b""}
    scope |= {"headers": [(b"content-type", b"multipart/form-data; boundary=x")], "client": ("192.0.2.1", 1)}

    async def receive():
        asked.append(1)
        return {"type": "http.request", "body": bytes(1000), "more_body": True}

    async def send(message):
        answered.append(message)

    asyncio.run(closed.app(scope, receive, send))

    assert answered[0]["status"] == 401
    assert asked == []


def test_a_program_with_a_write_key_does_its_work_and_reads_the_result(closed, keys):
    write = bearer(keys[AccessScope.WRITE])
    package = {"package": ("p.zip", make_package(make_document()), "application/zip")}

    product = closed.post("/api/v1/products", files=package, headers=write)
    design = closed.post(f"/api/v1/products/{product.json()['id']}/designs", json={}, headers=write)
    cancelled = closed.post(f"/api/v1/jobs/{design.json()['id']}/cancel", headers=write)
    events = closed.get(f"/api/v1/jobs/{design.json()['id']}/events", headers=bearer(keys[AccessScope.READ]))

    assert [answer.status_code for answer in (product, design, cancelled, events)] == [201, 202, 202, 200]
    assert '"status": "cancelled"' in events.text


def test_on_loopback_no_key_is_asked_but_a_wrong_one_is_refused(client, service, problem):
    assert client.get("/api/v1/jobs").status_code == 200
    problem(client.get("/api/v1/jobs", headers=bearer("gwk_a_b")), 401)
    made = new_key(service, "reader on loopback")
    problem(client.post("/api/v1/gripper-sets", json={}, headers=bearer(made.word)), 403, "scope-missing")


@pytest.mark.parametrize(
    ("host", "asks"),
    [
        *((host, False) for host in ("127.0.0.1", "127.8.0.1", "::1", "localhost")),
        *((host, True) for host in ("0.0.0.0", "::", "", "10.0.0.7", "plm.example")),
    ],
)
def test_access_is_asked_for_as_soon_as_others_can_reach_the_service(tmp_path, host, asks):
    settings = Settings(data_dir=tmp_path, host=host)

    assert settings.asks_for_access is asks
    assert settings.model_copy(update={"access_required": True}).asks_for_access


def test_a_service_that_nobody_could_use_is_not_started(tmp_path):
    settings = Settings(data_dir=tmp_path, host="0.0.0.0")
    database = Database(settings.resolved_database_url)
    migrate(database)

    with pytest.raises(Conflict, match="gripwright keys create"):
        require_way_in(settings, database, utc_now())
    with database.write_sessions.begin() as session:
        create_key(session, "ends", AccessScope.READ, timedelta(hours=1), utc_now(), actor="test")
    require_way_in(settings, database, utc_now())
    with pytest.raises(Conflict):
        require_way_in(settings, database, utc_now() + timedelta(hours=1))
    issuer = {"oidc_issuer": "https://issuer.example", "oidc_audience": "gripwright"}
    require_way_in(Settings(data_dir=tmp_path, host="0.0.0.0", **issuer), database, utc_now() + timedelta(hours=1))
    database.dispose()


def test_no_product_is_told_to_whom_may_not_read(closed, problem):
    product_id = store_product(closed.service.database, closed.service.artifacts)

    body = problem(closed.get(f"/api/v1/products/{product_id}"), 401)

    assert product_id not in str(body)
