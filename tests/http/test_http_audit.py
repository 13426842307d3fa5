"""What every answer has, and what is kept of it."""

from datetime import timedelta

import pytest
from fastapi import APIRouter
from fastapi.testclient import TestClient
from sqlalchemy.exc import InterfaceError, OperationalError, TimeoutError

from gripwright.domain.access import ANYBODY, AccessScope
from gripwright.http.app import create_app
from gripwright.http.audit_trail import STRANGERS_A_MINUTE, AuditTrail
from gripwright.http.observed import SECURITY_HEADERS
from gripwright.jobs.keys import create_key
from gripwright.settings import Settings
from gripwright.store.audit import AuditRepository
from gripwright.store.columns import new_id, utc_now
from gripwright.store.migrate import migrate
from gripwright.store.models import AuditRow
from service_factory import make_document, make_package

PLM = "https://plm.example"
broken = APIRouter()


@broken.get("/api/v1/broken")
def fail():
    raise RuntimeError("a secret of the service")


UNANSWERED = {
    "gone": OperationalError("SELECT 1", None, Exception("a secret of the service")),
    "closed": InterfaceError("SELECT 1", None, Exception("a secret of the service")),
    "exhausted": TimeoutError("a secret of the service"),
}


@broken.get("/api/v1/unanswered/{how}")
def ask_in_vain(how: str):
    raise UNANSWERED[how]


@pytest.fixture(scope="module")
def audited(tmp_path_factory):
    """A service that asks for access and lets pages of a PLM system in."""
    settings = Settings(data_dir=tmp_path_factory.mktemp("audited"), access_required=True, cors_origins=(PLM,))
    app = create_app(settings)
    app.include_router(broken)
    with TestClient(app, base_url="http://127.0.0.1:8000", raise_server_exceptions=False) as client:
        app.state.service.wait_for_plugins(60)
        with app.state.service.database.write_sessions.begin() as session:
            client.key = create_key(session, "PLM", AccessScope.ADMIN, timedelta(days=1), utc_now(), actor="cli:ada")
        client.headers["Authorization"] = f"Bearer {client.key.word}"
        yield client


def trail(client, **query):
    answer = client.get("/api/v1/audit", params=query)
    assert answer.status_code == 200, answer.text
    return answer.json()["items"]


def test_the_trail_says_who_did_what_when_and_with_what_outcome(audited):
    before = utc_now()
    package = {"package": ("p.zip", make_package(make_document()), "application/zip")}
    product = audited.post("/api/v1/products", files=package, headers={"X-Request-ID": "order-17"}).json()["id"]
    design = audited.post(f"/api/v1/products/{product}/designs?x=secret", json={}).json()["id"]
    refused = audited.post(f"/api/v1/jobs/{design}/retry")
    audited.delete("/api/v1/actuators/Acme/C%2F10")

    rows = trail(audited, limit=4)

    who = {(row["actor"], row["actor_name"], row["client"]) for row in rows}
    assert who == {(f"key:{audited.key.row.id}", "PLM", "testclient")}
    assert [(row["method"], row["path"], row["status"], row["resource_id"]) for row in reversed(rows)] == [
        ("POST", "/api/v1/products", 201, product),
        ("POST", f"/api/v1/products/{product}/designs", 202, design),
        ("POST", f"/api/v1/jobs/{design}/retry", 409, design),
        ("DELETE", "/api/v1/actuators/Acme/C%2F10", 404, "Acme/C/10"),
    ]
    assert rows[3]["request_id"] == "order-17"
    assert rows[1]["request_id"] == refused.headers["X-Request-ID"]
    assert before.isoformat()[:19] <= rows[3]["at"][:19] <= utc_now().isoformat()[:19]
    assert [row["resource_id"] for row in trail(audited, resource_id=product)] == [product]


def test_a_key_that_is_made_is_in_the_trail(audited):
    rows = trail(audited, actor="cli:ada")

    assert [(row["method"], row["path"], row["resource_id"]) for row in rows] == [("CLI", "keys create PLM", audited.key.row.id)]


def test_who_was_refused_is_in_the_trail_and_what_was_read_is_not(audited):
    audited.get("/api/v1/products?part_number=x", headers={"Authorization": "Bearer gwk_no_key", "X-Request-ID": "intruder"})
    audited.get("/api/v1/products", headers={"X-Request-ID": "reader"})
    audited.get("/", headers={"X-Request-ID": "page"})

    rows = {row["request_id"]: row for row in trail(audited, limit=10)}

    assert (rows["intruder"]["actor"], rows["intruder"]["status"], rows["intruder"]["method"]) == ("", 401, "GET")
    assert not {"reader", "page"} & set(rows)


def test_nobody_outside_can_fill_the_disk():
    trail, now = AuditTrail(None, days=1, with_reads=False), utc_now()

    stored = [trail.holds("POST", 401, None, now) for _ in range(STRANGERS_A_MINUTE + 50)]

    assert stored == [True] * STRANGERS_A_MINUTE + [False] * 50
    assert trail.holds("POST", 200, ANYBODY, now), "who is let in is not left out"
    assert trail.holds("POST", 401, None, now + timedelta(minutes=1))


def test_reads_are_in_the_trail_where_that_is_asked_for(tmp_path):
    app = create_app(Settings(data_dir=tmp_path, audit_reads=True))
    migrate(app.state.service.database)
    client = TestClient(app, base_url="http://127.0.0.1:8000")

    client.get("/api/v1/products", headers={"X-Request-ID": "reader"})
    rows = trail(client)
    app.state.service.stop()

    assert [(row["actor"], row["request_id"], row["status"]) for row in rows] == [("anonymous", "reader", 200)]


def test_pages_of_the_trail_hold_each_row_once_the_newest_first(audited):
    for number in range(5):
        audited.post("/api/v1/jobs/none/cancel", headers={"X-Request-ID": f"page-{number}"})

    found, url = [], "/api/v1/audit?limit=2"
    while url is not None:
        answer = audited.get(url)
        found += [row["request_id"] for row in answer.json()["items"]]
        url = answer.links.get("next", {}).get("url")

    assert found[:5] == [f"page-{number}" for number in (4, 3, 2, 1, 0)]
    assert [name for name in found if name.startswith("page-")] == found[:5]


@pytest.mark.parametrize("given", ["", "a b", "x" * 65, "é", "a\tb"])
def test_an_id_of_a_request_that_could_forge_a_log_is_replaced(audited, given):
    answer = audited.get("/health/live", headers={"X-Request-ID": given.encode()})

    assert len(answer.headers["X-Request-ID"]) == 32


def test_rows_older_than_the_setting_are_removed_at_most_once_an_hour(audited):
    database, now = audited.app.state.service.database, utc_now()
    old = AuditTrail(database, days=30, with_reads=False)

    def row(age):
        at = now - age
        return AuditRow(
            id=new_id(at), created_at=at, actor="old", actor_name="", client="", method="POST", path="/", status=200,
            resource_id="", request_id=str(age.days),
        )  # fmt: skip

    with database.write_sessions.begin() as session:
        for days in (29, 31, 400):
            AuditRepository(session).add(row(timedelta(days=days)))
    old.clear(now)
    assert [entry["request_id"] for entry in trail(audited, actor="old")] == ["29"]

    with database.write_sessions.begin() as session:
        AuditRepository(session).add(row(timedelta(days=50)))
    old.clear(now + timedelta(minutes=59))
    assert [entry["request_id"] for entry in trail(audited, actor="old")] == ["29", "50"]
    old.clear(now + timedelta(days=2))
    assert trail(audited, actor="old") == []


@pytest.mark.parametrize(
    ("path", "status"),
    [
        ("/", 200),
        ("/dashboard/style.css", 200),
        ("/health/live", 200),
        ("/metrics", 200),
        ("/api/v1/jobs", 200),
        ("/api/v1/products/none", 404),
        ("/nothing", 404),
        ("/api/v1/broken", 500),
    ],
)
def test_every_answer_has_the_security_headers(audited, path, status):
    answer = audited.get(path)

    assert answer.status_code == status
    for name, value in SECURITY_HEADERS.items():
        if name != "Content-Security-Policy":
            assert answer.headers[name] == value
    assert "default-src 'none'" in answer.headers["Content-Security-Policy"]
    assert "frame-ancestors 'none'" in answer.headers["Content-Security-Policy"]


def test_a_refused_answer_has_them_too_and_a_defect_tells_nothing(audited, problem):
    unsigned = audited.get("/api/v1/jobs", headers={"Authorization": ""})
    defect = audited.get("/api/v1/broken")

    assert unsigned.status_code == 401
    assert {name: unsigned.headers[name] for name in SECURITY_HEADERS} == SECURITY_HEADERS
    assert "secret" not in str(problem(defect, 500, "internal"))


@pytest.mark.parametrize("how", UNANSWERED)
def test_a_database_that_does_not_answer_is_no_defect_but_a_reason_to_come_again(audited, problem, how):
    answer = audited.get(f"/api/v1/unanswered/{how}")

    assert "secret" not in str(problem(answer, 503, "not-ready"))
    assert answer.headers["Retry-After"] == "5"


def test_a_defect_before_the_routes_is_a_problem_too(audited, problem, monkeypatch):
    monkeypatch.setattr(audited.app.state.service.limits, "_requests", {})

    problem(audited.get("/api/v1/jobs"), 500, "internal")


def preflight(client, origin, method="POST"):
    headers = {"Origin": origin, "Access-Control-Request-Method": method, "Access-Control-Request-Headers": "authorization"}
    return client.options("/api/v1/products", headers={**headers, "Authorization": ""})


def test_pages_of_a_listed_origin_may_read_answers_and_errors(audited):
    allowed = preflight(audited, PLM)
    refused = audited.get("/api/v1/jobs", headers={"Origin": PLM, "Authorization": ""})

    assert allowed.status_code == 200
    assert allowed.headers["Access-Control-Allow-Origin"] == PLM
    assert "access-control-allow-credentials" not in allowed.headers
    assert refused.status_code == 401
    assert refused.headers["Access-Control-Allow-Origin"] == PLM
    assert "Location" in audited.get("/api/v1/jobs", headers={"Origin": PLM}).headers["Access-Control-Expose-Headers"]


def test_pages_of_another_origin_may_not(audited, problem):
    problem(preflight(audited, "https://evil.example"), 403, "origin-refused")
    answer = audited.get("/api/v1/jobs", headers={"Origin": "https://evil.example"})

    assert not [name for name in answer.headers if name.startswith("access-control-allow")]


@pytest.mark.parametrize("method", ["POST", "DELETE"])
def test_where_no_key_is_asked_pages_of_other_sites_are_turned_away(client, problem, method):
    """A form of any page can send a POST to loopback; it need not read the answer to do harm."""
    problem(client.request(method, "/api/v1/products", headers={"Origin": "https://evil.example"}), 403, "origin-refused")
    for odd in ("null", "http://[", "127.0.0.1:8000", ""):
        problem(client.request(method, "/api/v1/products", headers={"Origin": odd}), 403, "origin-refused")
    own = client.request(method, "/api/v1/products", headers={"Origin": "http://127.0.0.1:8000"})
    assert own.status_code != 403
    assert not [name for name in own.headers if name.startswith("access-control-")]


def test_no_page_of_another_site_may_read_where_no_origin_is_listed(client):
    answer = client.get("/api/v1/products", headers={"Origin": "https://evil.example"})
    asked = client.options(
        "/api/v1/products", headers={"Origin": "https://evil.example", "Access-Control-Request-Method": "POST"}
    )

    assert not [name for name in (*answer.headers, *asked.headers) if name.startswith("access-control-")]
