"""A design whose artifacts and step results live in S3-compatible storage, down to the download."""

import pytest
from fake_calculation import executed
from fastapi.testclient import TestClient
from service import make_service

from gripwright.http.app import create_app


@pytest.fixture
def service(tmp_path, monkeypatch, s3_storage):
    service = make_service(tmp_path, monkeypatch, STORAGE_URL=s3_storage)
    yield service
    service.stop()


def test_a_design_is_computed_and_downloaded_from_s3_and_finished_steps_do_not_run_again(service):
    service.start_worker()

    first, again = (service.wait(service.request_design("a b c second")) for _ in range(2))

    assert [first.status, again.status] == ["succeeded", "succeeded"], (first.problem, again.problem)
    assert executed(service.log).count("begin:a") == 1
    assert not (service.settings.data_dir / "artifacts").exists()
    assert not (service.settings.data_dir / "steps").exists()
    client = TestClient(create_app(service.settings), base_url="http://localhost")
    url = f"/api/v1/designs/{first.id}/files/design.json"
    whole = client.get(url)
    assert whole.json()["status"] == "complete"
    assert client.get(url, headers={"Range": "bytes=2-7"}).content == whole.content[2:8]
    assert client.get(url, headers={"Range": "bytes=-3"}).content == whole.content[-3:]
    assert client.get(url, headers={"Range": f"bytes={len(whole.content)}-"}).status_code == 416
    assert client.get(url, headers={"Range": "bytes=2-7", "If-Range": '"another"'}).content == whole.content
