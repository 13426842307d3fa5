"""A seeded part of the corpus against a real service; tests/soak/bad_uploads.py sends all of it."""

import random
import socket
import time
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from urllib.parse import urlsplit

import pytest
from corpus import small_corpus
from hostile_service import hostile_service
from upload_bodies import MULTIPART, BadUpload, alone

from service_factory import make_document, make_package

_EACH = 4  # of a kind
_DEAR = ("step", "step alone")  # two of these: Open CASCADE takes a second to start


@pytest.fixture(scope="module")
def service(tmp_path_factory):
    with hostile_service(tmp_path_factory.mktemp("hostile")) as service:
        yield service


def _sample():
    kinds = defaultdict(list)
    for bad in small_corpus():
        kinds[bad.kind].append(bad)
    chance = random.Random(20)
    return [bad for kind, those in kinds.items() for bad in chance.sample(those, 2 if kind in _DEAR else _EACH)]


def test_malformed_uploads_are_refused_with_the_reason_and_leave_nothing_behind(service):
    before, uploads = service.leftovers(), _sample()

    with ThreadPoolExecutor(2) as pool:
        answers = list(pool.map(service.upload, uploads))

    faults = {bad.label: found for bad, answer in zip(uploads, answers, strict=True) if (found := service.faults_of(answer))}
    assert faults == {}
    assert len(uploads) >= 50
    assert service.leftovers() == before
    assert service.is_alive()
    assert service.defects() == []


def test_a_client_that_leaves_in_the_middle_of_an_upload_leaves_nothing_behind(service):
    before, address = service.leftovers(), urlsplit(service.address)

    for sent in (100, 2_000_000, 100, 2_000_000, 2_999_000):  # more than there are turns
        with socket.create_connection((address.hostname, address.port)) as connection:
            head = f"POST /api/v1/products HTTP/1.1\r\nHost: x\r\nContent-Type: {MULTIPART}\r\nContent-Length: 9000000\r\n\r\n"
            connection.sendall(head.encode() + alone(bytes(3_000_000))[:sent])
            time.sleep(0.1)

    time.sleep(0.5)
    assert service.leftovers() == before
    assert service.is_alive()
    assert service.defects() == []
    assert service.upload(BadUpload("sound", "", alone(make_package(make_document())))).status == 201


def test_the_corpus_holds_at_least_300_uploads_of_every_kind_each_named_once():
    labels = [bad.label for bad in small_corpus()]

    assert len(labels) >= 300
    assert {label.partition(":")[0] for label in labels} >= {"stl", "obj", "ply", "off", "3mf", "glb", "step", "zip", "manifest"}
