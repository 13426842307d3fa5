"""One promise, two kinds of place: a folder, and S3-compatible storage by a real server."""

import hashlib
import os
import subprocess
import sys
import time

import pytest

from gripwright.domain.errors import NotFound, StorageRefused, StorageUnavailable
from gripwright.settings import Settings
from gripwright.store.storage import open_artifacts, open_steps

DATA = bytes(range(256)) * 4096  # several pieces


@pytest.fixture(params=["folder", "s3"])
def url(request, tmp_path):
    return tmp_path.as_uri() if request.param == "folder" else request.getfixturevalue("s3_storage")


def test_an_artifact_comes_back_by_its_content_whole_and_in_parts(url):
    artifacts = open_artifacts(url)

    sha256 = artifacts.put(DATA)

    assert sha256 == hashlib.sha256(DATA).hexdigest()
    assert artifacts.put(DATA) == sha256
    assert artifacts.has(sha256)
    assert artifacts.size(sha256) == len(DATA)
    assert artifacts.get(sha256) == DATA
    assert b"".join(artifacts.parts(sha256, 0, len(DATA))) == DATA
    assert b"".join(artifacts.parts(sha256, 1000, 300_000)) == DATA[1000:300_000]
    assert b"".join(artifacts.parts(sha256, 5, 5)) == b""
    assert [(state.name, state.size) for state in artifacts.files.all()] == [(f"{sha256[:2]}/{sha256}", len(DATA))]


@pytest.mark.parametrize("sha256", ["0" * 64, "../secret", ""])
def test_what_is_not_stored_is_not_found(url, sha256):
    artifacts = open_artifacts(url)

    assert not artifacts.has(sha256)
    with pytest.raises(NotFound):
        artifacts.get(sha256)
    with pytest.raises(NotFound):
        artifacts.size(sha256)


def test_a_damaged_step_result_counts_as_absent_and_is_computed_again(url):
    steps = open_steps(url)
    assert not steps.has("ab" * 32)
    steps.save("ab" * 32, b"result")
    assert steps.has("ab" * 32)
    assert steps.find("ab" * 32) == b"result"

    steps.files.write(f"ab/{'ab' * 32}", b"resulx" + hashlib.sha256(b"result").digest())

    assert steps.find("ab" * 32) is None
    assert not steps.has("ab" * 32)


def test_only_what_was_not_used_since_is_removed(url):
    files = open_artifacts(url).files
    files.write("ab/abc", b"data")
    before = files.state("ab/abc").modified_s - 10.0

    assert not files.remove("ab/abc", before)
    assert files.read("ab/abc") == b"data"
    assert files.remove("ab/abc", time.time() + 10.0)
    assert not files.remove("ab/abc", time.time() + 10.0)
    assert files.read("ab/abc") is None


def test_use_renews_the_time_of_a_file(tmp_path):
    artifacts, steps = open_artifacts(tmp_path.as_uri()), open_steps(tmp_path.as_uri())
    sha256 = artifacts.put(b"data")
    steps.save("ab" * 32, b"result")
    paths = [artifacts.files.folder / sha256[:2] / sha256, steps.files.folder / "ab" / ("ab" * 32)]
    for path in paths:
        os.utime(path, (1.0, 1.0))

    artifacts.put(b"data")
    steps.has("ab" * 32)

    assert all(time.time() - path.stat().st_mtime < 60.0 for path in paths)


def test_storage_that_refuses_is_told_from_storage_that_is_silent(s3_storage, monkeypatch):
    with pytest.raises(StorageRefused, match="the bucket does not exist"):
        open_artifacts("s3://no-such-bucket/folder").put(b"data")
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
    with pytest.raises(StorageUnavailable, match="does not answer"):
        open_artifacts("s3://silent/folder").put(b"data")


def test_a_full_disk_is_said_and_leaves_no_part_behind(tmp_path):
    script = (
        "import pathlib, time; from gripwright.store.files import LocalFiles; from gripwright.domain.errors import *\n"
        f"files = LocalFiles(pathlib.Path({str(tmp_path)!r}))\n"
        "files.write('ab/one', bytes(4096))\n"
        "try: files.write('ab/two', bytes(2**20))\n"
        "except InsufficientStorage as error: print(error.detail)\n"
        "print([state.name for state in files.all()], files.remove_parts(time.time() + 10))"
    )
    mounted = f'mount -t tmpfs -o size=64k none {tmp_path} && exec {sys.executable} -c "$SCRIPT"'

    command = ["unshare", "--map-root-user", "--mount", "sh", "-c", mounted]  # a small disk that nobody else sees
    done = subprocess.run(command, env=os.environ | {"SCRIPT": script}, capture_output=True, text=True, check=False)

    assert done.stdout.splitlines() == ["no space is left for 1048576 bytes: No space left on device", "['ab/one'] 0"], (
        done.stderr
    )


@pytest.mark.parametrize("url", ["ftp://host/folder", "file://host/folder", "file:folder", "s3:///folder", "/folder"])
def test_a_storage_that_is_none_is_refused(url):
    with pytest.raises(ValueError, match="the storage is"):
        Settings(storage_url=url)
