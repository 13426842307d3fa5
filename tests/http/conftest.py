import itertools

import pytest
from fastapi.testclient import TestClient
from key_factory import new_key

from gripwright.domain.access import AccessScope
from gripwright.http.app import create_app
from gripwright.settings import Settings
from gripwright.store.jobs import StoredDesignJobs
from service_factory import store_product


@pytest.fixture(scope="session")
def app(tmp_path_factory):
    settings = Settings(
        data_dir=tmp_path_factory.mktemp("service"),
        upload_max_bytes=200_000,
        body_max_bytes=50_000,
        webhook_private_targets=True,
        gripper_set_timeout_s=20.0,
        import_max_packages=5,
        wait_max_s=20,
        wait_requests=60,
    )
    return create_app(settings)


@pytest.fixture(scope="session")
def client(app):
    with TestClient(app, base_url="http://127.0.0.1:8000", raise_server_exceptions=False) as client:
        app.state.service.wait_for_plugins(60)
        yield client


_addresses = itertools.count(1)


@pytest.fixture(scope="session")
def closed_client(tmp_path_factory):
    """A client of a service that asks for access on loopback, too."""
    settings = Settings(data_dir=tmp_path_factory.mktemp("closed"), access_required=True)
    app = create_app(settings)
    with TestClient(app, base_url="http://127.0.0.1:8000", raise_server_exceptions=False) as client:
        app.state.service.wait_for_plugins(60)
        client.service = app.state.service
        yield client


@pytest.fixture
def closed(closed_client):
    """The same from an address of its own: credentials that were refused to other tests do not count."""
    closed_client._transport.client = (f"192.0.2.{next(_addresses)}", 50_000)
    return closed_client


@pytest.fixture(scope="session")
def keys(closed_client):
    """A key of each scope."""
    return {scope: new_key(closed_client.service, f"the {scope} key", scope).word for scope in AccessScope}


@pytest.fixture
def service(app, client):
    return app.state.service


@pytest.fixture
def jobs(service):
    """The workers' side of the queue."""
    return StoredDesignJobs(service.database, service.artifacts)


@pytest.fixture
def product_id(service):
    return store_product(service.database, service.artifacts)


@pytest.fixture
def design_id(client, product_id):
    return client.post(f"/api/v1/products/{product_id}/designs", json={}).json()["id"]


@pytest.fixture
def finish(jobs, service):
    """Ends a design as a worker would: with a document, a BOM and two files."""

    def finish(design_id, status="complete", files=(), operations=()):
        shared = {"gripper": "G1", "make_or_buy": "buy", "maker": "", "description": "", "material": "", "files": []}
        rows = [
            {**shared, "item": "actuator", "model": "MHF2-12D2", "quantity": 1, "mass_kg": 0.5, "operations": ["a", "b"]},
            {**shared, "item": "screw", "model": "=1+1", "quantity": 2, "mass_kg": None, "operations": []},
        ]
        bom = [{**row, "part_number": row["model"]} for row in rows]
        product = {"part_number": "P", "revision": "A"}
        document = {"product": product, "status": status, "operations": list(operations), "grippers": [], "bom": bom}
        stored = {
            "bom.csv": b"gripper,item\r\nG1,actuator\r\nG1,finger\r\n",
            "report.html": b"<!doctype html><title>report</title>",
            "grippers/G1/finger.step": b"ISO-10303-21;" + bytes(range(256)),
            **dict(files),
        }
        assert jobs.start(design_id, 1)
        jobs.finish(design_id, 1, status, document, {path: service.artifacts.put(data) for path, data in stored.items()})

    return finish


def assert_problem(answer, status, code=None):
    """The answer is a problem document of that status; its body."""
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    body = answer.json()
    assert body["status"] == status
    assert {"type", "title", "detail"} <= set(body)
    if code is not None:
        assert body["type"] == f"urn:gripwright:problem:{code}"
    return body


@pytest.fixture
def problem():
    return assert_problem
