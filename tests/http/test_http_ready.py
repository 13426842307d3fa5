import shutil
import time

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import text

from gripwright.http.app import create_app
from gripwright.jobs.supervisor import Supervisor
from gripwright.settings import Settings


@pytest.fixture
def service(tmp_path):
    """A service of its own, that tests may break; its `get` asks it."""
    app = create_app(Settings(data_dir=tmp_path / "data", plugins_allow=()))
    with TestClient(app, base_url="http://localhost", raise_server_exceptions=False) as client:
        app.state.service.wait_for_plugins(60)
        app.state.service.get = client.get
        app.state.service.ready_s = 0.0
        yield app.state.service


def refuse_writes(service):
    with service.database.write_engine.begin() as connection:
        connection.execute(
            text("CREATE TRIGGER no_write BEFORE UPDATE ON alembic_version BEGIN SELECT RAISE(FAIL, 'read-only'); END")
        )


def forget_migrations(service):
    with service.database.write_engine.begin() as connection:
        connection.execute(text("UPDATE alembic_version SET version_num = '0001'"))


def put_a_file_in_the_way(service):
    shutil.rmtree(service.settings.data_dir / "artifacts", ignore_errors=True)
    (service.settings.data_dir / "artifacts").write_text("")


def fill_the_disk(service):
    service.settings = service.settings.model_copy(update={"disk_free_min_bytes": 2**60})


def lose_the_workers(service):
    service.live_workers = lambda: 0


@pytest.mark.parametrize(
    ("fault", "check"),
    [
        (refuse_writes, "database"),
        (forget_migrations, "database"),
        (put_a_file_in_the_way, "storage"),
        (fill_the_disk, "storage"),
        (lose_the_workers, "workers"),
    ],
)
def test_a_service_that_cannot_work_says_which_check_failed_and_no_path(service, problem, fault, check):
    assert service.get("/health/ready").json() == {"status": "ok"}

    fault(service)

    answer = service.get("/health/ready")
    body = problem(answer, 503, "not-ready")
    assert [error["pointer"] for error in body["errors"]] == [f"/checks/{check}"]
    assert str(service.settings.data_dir) not in answer.text
    assert "sqlite" not in answer.text
    assert service.get("/health/live").status_code == 200


def test_a_supervisor_knows_how_many_of_its_workers_run(tmp_path):
    supervisor = Supervisor(Settings(data_dir=tmp_path, workers=2), command=("sleep", "60"))
    assert supervisor.count_alive() == 0

    supervisor.start()
    deadline = time.monotonic() + 10
    while supervisor.count_alive() < 2:
        assert time.monotonic() < deadline
        time.sleep(0.02)
    supervisor.stop()

    assert supervisor.count_alive() == 0
