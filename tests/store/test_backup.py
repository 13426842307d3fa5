import shutil

import pytest
from fastapi.testclient import TestClient
from typer.testing import CliRunner

from gripwright.cli import app
from gripwright.http.app import create_app
from gripwright.jobs.hosts import ProcessName
from gripwright.settings import Settings
from gripwright.store.designs import DesignRepository
from gripwright.store.engines import Database
from gripwright.store.jobs import StoredDesignJobs
from gripwright.store.storage import open_artifacts
from gripwright.store.workers import WorkerRegister
from service_factory import make_document, make_package

PACKAGE = "package.zip"


def run(settings, *arguments):
    variables = {"GRIPWRIGHT_DATA": str(settings.data_dir), "GRIPWRIGHT_DATABASE_URL": settings.database_url}
    return CliRunner().invoke(app, list(arguments), env=variables)


def design_over_http(client, jobs, artifacts):
    """Upload a product and design it, as a worker would end it; the address of its files and the id of a design that waits."""
    files = {"package": (PACKAGE, make_package(make_document("B-1")), "application/zip")}
    product_id = client.post("/api/v1/products", files=files).json()["id"]
    ended, waiting = (client.post(f"/api/v1/products/{product_id}/designs", json={}).json()["id"] for _ in range(2))
    assert jobs.start(ended, 1)
    stored = {"grippers/G1/finger.step": artifacts.put(b"ISO-10303-21;" * 1000)}
    jobs.finish(ended, 1, "complete", {"status": "complete", "bom": []}, stored)
    assert jobs.start(waiting, 1)
    return product_id, f"/api/v1/designs/{ended}", waiting


@pytest.fixture(params=["sqlite", "postgresql"])
def settings(request, tmp_path):
    """Of a service in a folder, and of another one that is empty, both of the same kind."""
    if request.param == "sqlite":
        return Settings(data_dir=tmp_path / "one"), Settings(data_dir=tmp_path / "two")
    server = request.getfixturevalue("postgresql_server")
    urls = [server.create_database(f"{name}_{tmp_path.name}") for name in ("one", "two")]
    return [Settings(data_dir=tmp_path / name, database_url=url) for name, url in zip(("one", "two"), urls, strict=True)]


def test_what_was_backed_up_while_the_service_ran_is_restored_to_the_same_bytes(settings, tmp_path):
    first, second = settings
    assert run(first, "migrate").exit_code == 0
    with TestClient(create_app(first), base_url="http://localhost") as client:
        client.app.state.service.wait_for_plugins(60)
        service = client.app.state.service
        product_id, address, waiting = design_over_http(
            client, StoredDesignJobs(service.database, service.artifacts), service.artifacts
        )
        paths = [f"/api/v1/products/{product_id}", f"{address}/files/grippers/G1/finger.step", f"{address}/package.zip", address]
        before = [client.get(path).content for path in paths]

        made = run(first, "backup", str(tmp_path / "backup"))
        again = run(first, "backup", str(tmp_path / "backup"))

    assert (made.exit_code, again.exit_code) == (0, 0), made.output + again.output
    restored = run(second, "restore", str(tmp_path / "backup"))
    refused = run(second, "restore", str(tmp_path / "backup"))
    forced = run(second, "restore", str(tmp_path / "backup"), "--force")
    assert (restored.exit_code, refused.exit_code, forced.exit_code) == (0, 1, 0), restored.output + forced.output
    assert "not empty" in refused.stderr
    with TestClient(create_app(second), base_url="http://localhost") as client:
        after = [client.get(path).content for path in paths]
        assert after == before
        with client.app.state.service.database.read_sessions() as session:
            job = DesignRepository(session).get(waiting).job
            assert (job.status, job.attempt, job.dispatched) == ("queued", 2, False)


@pytest.fixture(scope="module")
def one_backup(tmp_path_factory):
    """A backup of one product."""
    tmp_path = tmp_path_factory.mktemp("backup")
    first = Settings(data_dir=tmp_path / "one")
    assert run(first, "migrate").exit_code == 0
    with TestClient(create_app(first), base_url="http://localhost") as client:
        files = {"package": (PACKAGE, make_package(make_document("B-2")), "application/zip")}
        assert client.post("/api/v1/products", files=files).status_code == 201
    assert run(first, "backup", str(tmp_path / "backup")).exit_code == 0
    return tmp_path / "backup"


@pytest.fixture
def backed_up(tmp_path, one_backup):
    """That backup, and a service that is empty."""
    shutil.copytree(one_backup, tmp_path / "backup")
    return tmp_path / "backup", Settings(data_dir=tmp_path / "two")


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda folder: next(folder.glob("artifacts/*/*")).write_bytes(b"other"), "or has them damaged"),
        (lambda folder: next(folder.glob("artifacts/*/*")).unlink(), "the backup lacks 1 of"),
        (lambda folder: (folder / "gripwright.db").open("ab").write(b"x"), "is damaged: its sha-256 is"),
        (lambda folder: (folder / "backup.json").unlink(), "no complete backup"),
        (lambda folder: (folder / "backup.json").write_text("{"), "cannot be read"),
    ],
)
def test_a_damaged_backup_is_refused_before_anything_is_written(backed_up, damage, words):
    folder, settings = backed_up
    damage(folder)

    refused = run(settings, "restore", str(folder))

    assert refused.exit_code == 1
    assert words in refused.stderr
    artifacts = open_artifacts(settings.resolved_storage_url)
    assert list(artifacts.files.all()) == []


def test_nothing_is_restored_under_workers_that_run(backed_up):
    folder, settings = backed_up
    assert run(settings, "migrate").exit_code == 0
    database = Database(settings.resolved_database_url)
    process = str(ProcessName.own())
    WorkerRegister(database).enter(id="w", host="there", process=process, pid=1, version="1")

    refused = run(settings, "restore", str(folder), "--force")
    listed = run(settings, "workers")

    assert refused.exit_code == 1
    assert "1 workers run, one of them on there" in refused.stderr
    assert listed.output.split()[:2] == ["w", "there"]
    assert "live" in listed.output
    database.dispose()
