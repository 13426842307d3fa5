import os
import subprocess
import sys
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from gripwright.domain.errors import InsufficientStorage
from gripwright.http.app import create_app
from gripwright.settings import Settings
from gripwright.store.files import LocalFiles
from gripwright.store.quota import Quota
from gripwright.store.storage import open_artifacts
from service_factory import make_document, make_package

FULL_DISK = """
import pathlib, os
from fastapi.testclient import TestClient
from gripwright.http.app import create_app
from gripwright.settings import Settings
from service_factory import make_document, make_package
folder = pathlib.Path(os.environ["FOLDER"])
app = create_app(Settings(data_dir=folder, disk_free_min_bytes=0))
with TestClient(app, base_url="http://localhost", raise_server_exceptions=False) as client:
    client.app.state.service.wait_for_plugins(60)
    def upload(name):
        files = {"package": ("package.zip", make_package(make_document(name)), "application/zip")}
        answer = client.post("/api/v1/products", files=files)
        print(answer.status_code, answer.json().get("type"))
    with (folder / "filler").open("wb", buffering=0) as filler:
        try:
            while filler.write(bytes(512)): pass
        except OSError: pass
    def stored():
        return sorted(path.name for path in folder.glob("artifacts/*/*"))
    before = stored()
    upload("F-1")
    print(len(client.get("/api/v1/products").json()["items"]), before == stored())
    (folder / "filler").unlink()
    upload("F-1")
"""


def test_an_upload_and_a_design_beyond_the_quota_are_answered_with_507_and_store_nothing(tmp_path):
    settings = Settings(data_dir=tmp_path, disk_quota_bytes=200_000)
    with TestClient(create_app(settings), base_url="http://localhost", raise_server_exceptions=False) as client:
        client.app.state.service.wait_for_plugins(60)
        files = {"package": ("package.zip", make_package(make_document("Q-1")), "application/zip")}
        product_id = client.post("/api/v1/products", files=files).json()["id"]
        open_artifacts(settings.resolved_storage_url).put(bytes(200_000))
        client.app.state.service.artifacts._quota._count_at_s = 0.0  # a minute has gone by
        stored = sorted(path.name for path in tmp_path.glob("artifacts/*/*"))

        files = {"package": ("package.zip", make_package(make_document("Q-2")), "application/zip")}
        answers = [client.post("/api/v1/products", files=files), client.post(f"/api/v1/products/{product_id}/designs", json={})]

        for answer in answers:
            assert answer.status_code == 507, answer.text
            assert answer.json()["type"] == "urn:gripwright:problem:insufficient-storage"
            assert "at most 200000 are allowed" in answer.json()["detail"]
        assert len(client.get("/api/v1/products").json()["items"]) == 1
        assert sorted(path.name for path in tmp_path.glob("artifacts/*/*")) == stored
        assert client.get("/health/ready").status_code == 200


def test_a_full_disk_is_answered_with_507_and_works_again_when_there_is_room(tmp_path):
    mounted = f'mount -t tmpfs -o size=4m none {tmp_path} && exec {sys.executable} -c "$SCRIPT"'
    paths = os.pathsep.join([str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    environment = os.environ | {"SCRIPT": FULL_DISK, "FOLDER": str(tmp_path), "PYTHONPATH": paths}

    command = ["unshare", "--map-root-user", "--mount", "sh", "-c", mounted]  # a small disk that nobody else sees
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)

    said = ["507 urn:gripwright:problem:insufficient-storage", "0 True", "201 None"]
    assert done.stdout.splitlines() == said, done.stderr[-2000:]


def test_a_quota_counts_what_it_admits_before_it_counts_again(tmp_path):
    clock = [0.0]
    files = LocalFiles(tmp_path)
    quota = Quota((files,), max_bytes=100, free_min_bytes=0, clock=lambda: clock[0])
    files.write("ab/abc", bytes(50))

    quota.require_room(30)
    with pytest.raises(InsufficientStorage, match="holds 80 bytes and 30 more are needed; at most 100 are allowed"):
        quota.require_room(30)
    clock[0] = 61.0  # what was admitted was not stored after all
    quota.require_room(50)
    with pytest.raises(InsufficientStorage, match="holds 100 bytes and 0 more"):
        quota.require_room(0)


def test_what_must_stay_free_stays_free(tmp_path):
    free = LocalFiles(tmp_path).free_bytes()
    quota = Quota((LocalFiles(tmp_path),), max_bytes=None, free_min_bytes=free + 2**40)

    with pytest.raises(InsufficientStorage, match="must stay free"):
        quota.require_room(0)
