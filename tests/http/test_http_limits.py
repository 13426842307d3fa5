import re
from concurrent.futures import ThreadPoolExecutor

import pytest
from fastapi.testclient import TestClient
from key_factory import bearer, new_key

from gripwright.domain.access import AccessScope
from gripwright.http.app import create_app
from gripwright.http.rate_limits import CLIENTS, FAILURES_A_MINUTE, Buckets
from gripwright.settings import Settings
from gripwright.store.audit import AuditRepository

WEBHOOK = {"url": "https://93.184.215.14/hook"}


@pytest.fixture
def limited(tmp_path):
    """A service that asks for access and lets each client read and write three times at once."""
    settings = Settings(data_dir=tmp_path, access_required=True, rate_reads=60, rate_writes=6, rate_burst=3)
    app = create_app(settings)
    with TestClient(app, base_url="http://127.0.0.1:8000", raise_server_exceptions=False) as client:
        client.service = app.state.service
        yield client


def key_of(client, name, scope=AccessScope.WRITE):
    return bearer(new_key(client.service, name, scope).word)


def test_who_asks_too_much_is_told_when_to_come_again_and_others_are_served(limited, problem):
    greedy, modest = key_of(limited, "greedy"), key_of(limited, "modest")

    answers = [limited.post("/api/v1/webhooks", json=WEBHOOK, headers=greedy) for _ in range(4)]

    assert [answer.status_code for answer in answers] == [201, 201, 201, 429]
    problem(answers[3], 429, "too-many-requests")
    assert 1 <= int(answers[3].headers["Retry-After"]) <= 10, "six a minute are one in ten seconds"
    assert limited.get("/api/v1/jobs", headers=greedy).status_code == 200, "reads are counted apart"
    assert limited.post("/api/v1/webhooks", json=WEBHOOK, headers=modest).status_code == 201


def test_every_answer_says_what_is_left(limited):
    key = key_of(limited, "PLM")

    first, second = (limited.post("/api/v1/webhooks", json=WEBHOOK, headers=key) for _ in range(2))

    assert first.headers["RateLimit-Policy"] == '"writes";q=6;w=60'
    told = [re.fullmatch(r'"writes";r=(\d+);t=(\d+)', answer.headers["RateLimit"]) for answer in (first, second)]
    assert [int(match[1]) for match in told] == [2, 1]
    assert int(told[0][2]) == 10 < int(told[1][2]) <= 20  # some time has passed between them
    assert limited.get("/api/v1/jobs", headers=key).headers["RateLimit-Policy"] == '"reads";q=60;w=60'


def test_whoever_lacks_the_scope_is_limited_too(limited):
    reader = key_of(limited, "reader", AccessScope.READ)

    answers = [limited.post("/api/v1/webhooks", json=WEBHOOK, headers=reader).status_code for _ in range(5)]

    assert answers == [403, 403, 403, 429, 429]


def test_health_has_no_limit(limited):
    assert {limited.get("/health/live").status_code for _ in range(10)} == {200}


def test_an_address_that_tries_credentials_is_not_listened_to_for_a_while(limited, problem):
    key = key_of(limited, "PLM")
    tries = [limited.get("/api/v1/jobs", headers=bearer(f"gwk_{number}_x")) for number in range(2 * FAILURES_A_MINUTE)]
    assert [answer.status_code for answer in tries[:FAILURES_A_MINUTE]] == [401] * FAILURES_A_MINUTE
    assert tries[-1].status_code == 429

    refused = limited.get("/api/v1/jobs", headers=key)

    problem(refused, 429, "too-many-requests")
    assert int(refused.headers["Retry-After"]) >= 1
    assert limited.get("/health/live").status_code == 200
    assert limited.get("/api/v1/jobs").status_code == 401, "no credential is no attempt"


def test_a_client_that_is_refused_cannot_fill_the_audit_trail(limited):
    key = key_of(limited, "greedy")
    for _ in range(200):
        limited.post("/api/v1/webhooks", json=WEBHOOK, headers=key)

    with limited.service.database.read_sessions() as session:
        rows = AuditRepository(session).page(after=None, limit=500, actor=None, resource_id=None)
    assert 100 <= len([row for row in rows if row.status == 429]) <= 101


def test_on_loopback_nothing_is_limited_unless_it_is_asked_for(client):
    answer = client.get("/api/v1/jobs")

    assert "RateLimit" not in answer.headers


def test_a_bucket_fills_steadily_up_to_its_burst():
    buckets = Buckets(per_minute=60, burst=2)

    def served(now_s):
        if buckets.wait_s("a", now_s) > 0:
            return False
        buckets.take("a", now_s)
        return True

    assert [served(t) for t in (0.0, 0.0, 0.0, 0.5, 1.0, 1.5, 100.0, 100.0, 100.0)] == [
        *(True, True, False, False, True, False),
        *(True, True, False),
    ]
    assert buckets.wait_s("a", 100.25) == pytest.approx(0.75)


def test_the_limits_remember_so_many_clients_and_no_more():
    buckets = Buckets(per_minute=60, burst=2)

    for number in range(CLIENTS + 500):
        buckets.take(str(number), 0.0)

    assert len(buckets._buckets) == CLIENTS


def test_uploads_are_read_one_after_another_and_who_waits_too_long_comes_again(tmp_path, problem):
    app = create_app(Settings(data_dir=tmp_path, heavy_requests=1, heavy_wait_s=0.3))
    problem_set = {"strokes": {"parallel-2": 10}, "components": [{"id": "a", "alternatives": []}]}
    with TestClient(app, base_url="http://127.0.0.1:8000") as client:
        client.portal.call(app.state.service.turns.take)
        refused = client.post("/api/v1/gripper-sets", json=problem_set)
        lively = client.get("/api/v1/jobs")
        client.portal.call(app.state.service.turns.give_back)
        with ThreadPoolExecutor(4) as pool:
            served = list(pool.map(lambda _: client.post("/api/v1/gripper-sets", json=problem_set), range(4)))

    problem(refused, 503, "busy")
    assert int(refused.headers["Retry-After"]) >= 1
    assert lively.status_code == 200
    assert 200 in {answer.status_code for answer in served} <= {200, 503}


@pytest.mark.parametrize(
    "host", ["127.0.0.1:8000", "localhost", "LocalHost:9", "[::1]:8000", "127.9.9.9", "gripwright.localhost", "plm.example:80"]
)
def test_names_of_this_machine_and_those_allowed_are_answered(open_service, host):
    assert open_service.get("/api/v1/jobs", headers={"Host": host}).status_code == 200


@pytest.mark.parametrize(
    "host", ["evil.example", "127.0.0.1.evil.example", "10.0.0.1", "", "localhost@evil.example", "other.plm.example"]
)
def test_a_name_bound_to_this_machine_by_somebody_else_is_not(open_service, problem, host):
    for path in ("/", "/api/v1/jobs", "/openapi.json", "/health/ready"):
        problem(open_service.get(path, headers={"Host": host}), 421, "host-refused")


def test_where_a_key_is_asked_any_name_will_do(closed, keys):
    key = bearer(keys[AccessScope.READ])

    assert closed.get("/api/v1/jobs", headers={**key, "Host": "gripwright.plm.example"}).status_code == 200


@pytest.fixture(scope="module")
def open_service(tmp_path_factory):
    app = create_app(Settings(data_dir=tmp_path_factory.mktemp("open"), allowed_hosts=("PLM.example",)))
    with TestClient(app, base_url="http://127.0.0.1:8000") as client:
        yield client
