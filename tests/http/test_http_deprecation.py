from datetime import date

import pytest
from fastapi import APIRouter, FastAPI, Response
from fastapi.testclient import TestClient

from gripwright.domain.errors import NotFound
from gripwright.http.deprecation import deprecated
from gripwright.http.errors import problem, register_error_handlers
from gripwright.http.metrics import Metrics
from gripwright.http.observed import Observed
from gripwright.http.places import Places

PAGE = "https://gripwright.example/api#old"
TOLD = {"Deprecation": "@1767225600", "Sunset": "Fri, 01 Jan 2027 00:00:00 GMT"}
LINKS = [f'<{PAGE}>; rel="deprecation"; type="text/html"', f'<{PAGE}>; rel="sunset"; type="text/html"']

router = APIRouter()
old = deprecated(since=date(2026, 1, 1), sunset=date(2027, 1, 1), page=PAGE)


@router.get("/old/{name}", **old)
def get_old(name: str, response: Response) -> str:
    if name == "none":
        raise NotFound("no such thing")
    response.headers["Link"] = '</old/b>; rel="next"'
    return name


@router.get("/file", **old)
def get_file() -> Response:
    return Response(b"file")


@router.get("/new")
def get_new() -> str:
    return "new"


class Refusing:
    """Middleware that lets a stranger not get to the route."""

    def __init__(self, app):
        self._app = app

    async def __call__(self, scope, receive, send):
        is_stranger = scope["type"] == "http" and scope["query_string"] == b"stranger"
        await (problem(401, "not-authenticated", "who are you?") if is_stranger else self._app)(scope, receive, send)


@pytest.fixture
def client(app_of_old_and_new):
    return TestClient(app_of_old_and_new)


@pytest.fixture
def app_of_old_and_new():
    app = FastAPI()
    app.include_router(router)
    register_error_handlers(app)
    app.add_middleware(Refusing)
    app.add_middleware(Observed, places=Places([("", router)]), metrics=Metrics(), tracer=None)
    return app


@pytest.mark.parametrize(("path", "status"), [("/old/a", 200), ("/old/none", 404), ("/file", 200), ("/file?stranger", 401)])
def test_every_answer_of_a_route_that_will_go_says_so(client, path, status):
    answer = client.get(path)

    assert answer.status_code == status
    assert {name: answer.headers[name] for name in TOLD} == TOLD
    assert answer.headers.get_list("link")[-2:] == LINKS


def test_other_links_stay(client):
    assert client.get("/old/a").headers.get_list("link") == ['</old/b>; rel="next"', *LINKS]


def test_other_routes_say_nothing(client):
    assert not {"deprecation", "sunset", "link"} & set(client.get("/new").headers)


def test_the_document_marks_what_will_go(app_of_old_and_new):
    marked = {
        path: operations["get"].get("deprecated", False) for path, operations in app_of_old_and_new.openapi()["paths"].items()
    }

    assert marked == {"/old/{name}": True, "/file": True, "/new": False}
