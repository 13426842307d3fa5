"""The dashboard: one page with its style and scripts, nothing from elsewhere."""

from importlib import resources

from fastapi import APIRouter, Response

from gripwright.domain.errors import NotFound

router = APIRouter(include_in_schema=False)

_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_ASSETS = {
    "access.js": "text/javascript; charset=utf-8",
    "app.js": "text/javascript; charset=utf-8",
    "options.js": "text/javascript; charset=utf-8",
    "style.css": "text/css; charset=utf-8",
    "icon.svg": "image/svg+xml",
}


@router.get("/")
def page() -> Response:
    """The page."""
    return _file("index.html", "text/html; charset=utf-8")


@router.get("/dashboard/{name}")
def asset(name: str) -> Response:
    """What the page loads."""
    if name not in _ASSETS:
        raise NotFound(f"the dashboard has no {name}")
    return _file(name, _ASSETS[name])


def _file(name: str, media_type: str) -> Response:
    data = resources.files("gripwright.dashboard").joinpath(name).read_bytes()
    return Response(data, media_type=media_type, headers={"Content-Security-Policy": _POLICY, "Cache-Control": "no-cache"})
