import gzip
import json

import pytest

from gripwright.http.encodings import LEAST_BYTES, accepts_gzip

GZIP = {"Accept-Encoding": "gzip"}
PLAIN = {"Accept-Encoding": "identity"}


def raw(client, path, headers):
    """The answer with its body as it was sent."""
    with client.stream("GET", path, headers=headers) as answer:
        return answer, b"".join(answer.iter_raw())


def test_long_answers_are_compressed_for_those_who_take_it_and_say_so_to_caches(client):
    plain, whole = raw(client, "/api/v1/actuators", PLAIN)
    packed, data = raw(client, "/api/v1/actuators", GZIP)

    assert len(whole) > LEAST_BYTES > 0
    assert gzip.decompress(data) == whole
    assert len(data) < len(whole) / 3
    assert (packed.headers["Content-Encoding"], packed.headers["Content-Length"]) == ("gzip", str(len(data)))
    assert "Content-Encoding" not in plain.headers
    assert plain.headers["Vary"] == packed.headers["Vary"] == "Accept-Encoding"


def test_short_answers_are_sent_as_they_are(client):
    answer, body = raw(client, "/health/live", GZIP)

    assert json.loads(body) == {"status": "ok"}
    assert "Content-Encoding" not in answer.headers


def test_a_compressed_answer_has_a_strong_tag_of_its_own_which_conditions_may_name(client, product_id):
    path = f"/api/v1/products/{product_id}"
    plain, packed = client.get(path, headers=PLAIN), client.get(path, headers=GZIP)
    assert packed.headers["Content-Encoding"] == "gzip"
    assert (plain.headers["ETag"], packed.headers["ETag"]) == ('"1"', '"1-gzip"')

    known = client.get(path, headers={**GZIP, "If-None-Match": packed.headers["ETag"]})
    old = client.delete(path, headers={"If-Match": '"2-gzip"'})
    gone = client.delete(path, headers={"If-Match": packed.headers["ETag"]})

    assert (known.status_code, known.headers["ETag"]) == (304, '"1-gzip"')
    assert (old.status_code, gone.status_code) == (412, 204)


def test_files_keep_their_bytes_their_tag_and_their_ranges(client, design_id, finish):
    text = b"solid\n" * 1000
    finish(design_id, files={"part.stl": text}.items())
    path = f"/api/v1/designs/{design_id}/files/part.stl"

    whole, body = raw(client, path, GZIP)
    part, piece = raw(client, path, {**GZIP, "Range": "bytes=6-5000"})

    assert body == text
    assert piece == text[6:5001]
    assert {answer.headers.get("Content-Encoding") for answer in (whole, part)} == {None}
    assert whole.headers["ETag"] == part.headers["ETag"]


def test_the_bill_is_compressed_in_its_text_forms_alone(client, design_id, finish):
    finish(design_id, operations=[{"id": "a"}, {"id": "b"}])
    path = f"/api/v1/designs/{design_id}/bom"
    workbook = "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet"

    answers = [client.get(path, headers={**GZIP, "Accept": kind}) for kind in (workbook, "application/json")]

    assert len(answers[0].content) > LEAST_BYTES
    assert "Content-Encoding" not in answers[0].headers
    assert answers[1].headers["Vary"].startswith("Accept")


def test_a_stream_of_events_is_not_compressed(client, design_id):
    client.post(f"/api/v1/jobs/{design_id}/cancel")

    answer = client.get(f"/api/v1/jobs/{design_id}/events", headers=GZIP)

    assert "Content-Encoding" not in answer.headers
    assert "event: status" in answer.text


@pytest.mark.parametrize("encoding", ["gzip", "br", "gzip, gzip"])
def test_an_encoded_body_is_refused(client, problem, encoding):
    body = gzip.compress(json.dumps({"url": "https://93.184.215.14/"}).encode())

    answer = client.post("/api/v1/webhooks", content=body, headers={"Content-Encoding": encoding})

    problem(answer, 415, "unsupported-media-type")
    assert answer.headers["Accept-Encoding"] == "identity"
    plain = {"Content-Encoding": "identity"}
    assert client.post("/api/v1/webhooks", json={"url": "http://127.0.0.1:9/"}, headers=plain).status_code == 201


@pytest.mark.parametrize(
    ("header", "accepts"),
    [
        *[("gzip", True), ("GZIP;q=0.5", True), ("br, gzip", True), ("*", True), ("br;q=1, *;q=0.1", True)],
        *[("", False), ("br", False), ("gzip;q=0", False), ("gzip;q=0.000, *", False), ("*;q=0", False), ("gzipped", False)],
    ],
)
def test_gzip_is_sent_to_those_alone_who_name_it(header, accepts):
    assert accepts_gzip(header) is accepts
