import socket

import httpx
import pytest

from service_factory import make_document, make_package
from service_process import running_service

API = "/api/v1"
JSON = {"content-type": "application/json"}


@pytest.mark.parametrize(
    ("method", "path", "status", "allowed"),
    [
        ("GET", "/nowhere", 404, None),
        ("HEAD", "/nowhere", 404, None),
        ("OPTIONS", "/nowhere", 404, None),
        ("PUT", f"{API}/products", 405, "GET, HEAD, OPTIONS, POST"),
        ("TRACE", f"{API}/products/x", 405, "DELETE, GET, HEAD, OPTIONS, PATCH"),
        ("MAKE", f"{API}/products/x/operations", 405, "OPTIONS, PUT"),
        ("GET", f"{API}/gripper-sets", 405, "OPTIONS, POST"),
        ("MAKE", f"{API}/products/import", 405, "OPTIONS, POST"),
        ("HEAD", f"{API}/jobs/x/events", 405, "GET, OPTIONS"),
        ("POST", "/", 405, "GET, HEAD, OPTIONS"),
        ("GET", f"{API}/designs/x/files/%ff", 400, None),
        ("GET", f"{API}/products/%00", 400, None),
        ("GET", f"{API}/products?part_number=%ff", 400, None),
        ("GET", f"{API}/products?external_id=plm:%00", 400, None),
        ("PUT", f"{API}/actuators/%c3%28/x", 400, None),
    ],
)
def test_what_is_not_there_and_what_cannot_be_read_is_a_problem(client, method, path, status, allowed):
    answer = client.request(method, path)

    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.headers.get("allow") == allowed
    assert method == "HEAD" or answer.json()["status"] == status


@pytest.mark.parametrize(
    ("body", "status", "pointer"),
    [
        (b"{", 422, ""),
        (b'{"options": }', 422, ""),
        (b"", 422, ""),
        (b"[]", 422, ""),
        (b'{"options": 5}', 422, "/options"),
        (b'{"a/b~": 5}', 422, "/a~1b~0"),
        (b"\xff", 400, None),
        (b"[" * 40_000, 400, None),
    ],
)
def test_a_body_that_cannot_be_used_is_a_problem_with_the_place(client, product_id, problem, body, status, pointer):
    answer = client.post(f"{API}/products/{product_id}/designs", content=body, headers=JSON)

    found = problem(answer, status)
    assert pointer is None or [error["pointer"] for error in found["errors"]] == [pointer]


def test_options_names_what_a_path_allows_and_which_patches(client, product_id):
    answer = client.options(f"{API}/products/{product_id}")

    assert (answer.status_code, answer.content) == (204, b"")
    assert answer.headers["Allow"] == "DELETE, GET, HEAD, OPTIONS, PATCH"
    assert answer.headers["Accept-Patch"] == "application/merge-patch+json, application/json"


@pytest.mark.parametrize(
    "path", ["/", "/openapi.json", "/metrics", f"{API}/products/{{product}}", f"{API}/designs/{{design}}/package.zip"]
)
def test_head_is_get_without_the_body(client, product_id, design_id, finish, path):
    finish(design_id)
    url = path.format(product=product_id, design=design_id)

    head, get = client.head(url), client.get(url)

    assert head.content == b""
    left_out = {"x-request-id", "content-length"} if path == "/metrics" else {"x-request-id", "last-modified"}
    assert head.status_code == get.status_code == 200
    assert {k: v for k, v in head.headers.items() if k not in left_out} == {
        k: v for k, v in get.headers.items() if k not in left_out
    }


@pytest.mark.parametrize(
    "name", ["a" * 252 + ".step", "a\0b.step", "x/" * 260 + "a.step", "../a.step"], ids=["long", "nul", "deep", "out"]
)
@pytest.mark.parametrize("part", ["package", "files"])
def test_names_that_no_file_can_have_are_refused(client, problem, name, part):
    manifest = b'--x\r\nContent-Disposition: form-data; name="manifest"\r\n\r\n{}\r\n' if part == "files" else b""
    head = f'--x\r\nContent-Disposition: form-data; name="{part}"; filename="{name}"\r\n\r\n'.encode()
    body = manifest + head + b"solid\r\n--x--\r\n"

    answer = client.post(f"{API}/products", content=body, headers={"content-type": "multipart/form-data; boundary=x"})

    assert answer.status_code in (400, 422)
    problem(answer, answer.status_code)


def test_a_file_and_a_folder_of_the_same_name_are_refused(client, problem):
    files = [("manifest", (None, "{}")), ("files", ("a.stl", b"solid")), ("files", ("a.stl/b.stl", b"solid"))]

    body = problem(client.post(f"{API}/products", files=files), 422)

    assert body["errors"] == [{"pointer": "a.stl", "message": "both a file and a folder"}]


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    """Of a service in a process of its own, without workers."""
    with running_service(workers=0, folder=tmp_path_factory.mktemp("served")) as service:
        yield service.address


@pytest.mark.parametrize(
    "request_",
    [
        b"GARBAGE\r\n\r\n",
        b"GET /api/v1/products?part_number=\xff HTTP/1.1\r\nHost: x\r\n\r\n",
        b"GET / HTTP/1.1\r\n\r\n",
        b"POST /api/v1/gripper-sets HTTP/1.1\r\nHost: x\r\nContent-Length: -5\r\n\r\n{}",
    ],
)
def test_what_is_no_http_is_answered_with_a_problem(address, request_):
    url = httpx.URL(address)
    with socket.create_connection((url.host, url.port), timeout=10) as connection:
        connection.sendall(request_)
        answer = b"".join(iter(lambda: connection.recv(65536), b""))

    head, _, body = answer.partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 400 ")
    assert b"application/problem+json" in head
    assert b'"urn:gripwright:problem:bad-request"' in body


def test_a_server_sends_no_body_to_a_head(address):
    with httpx.Client(base_url=address, timeout=30) as client:
        package = ("package.zip", make_package(make_document()), "application/zip")
        location = client.post(f"{API}/products", files={"package": package}).headers["Location"]
        url = f"{location}/components/rotor/mesh.glb"

        heads = [client.head(url) for _ in range(3)]
        whole = client.get(url)

    assert [(head.status_code, head.content) for head in heads] == [(200, b"")] * 3
    assert int(heads[0].headers["Content-Length"]) == len(whole.content)
    assert heads[0].headers["ETag"] == whole.headers["ETag"]
