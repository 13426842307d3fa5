"""Routes that will go: marked in one place, told in the OpenAPI document and by every answer (RFC 9745, RFC 8594)."""

from dataclasses import dataclass
from datetime import UTC, date, datetime, time
from email.utils import format_datetime
from typing import Any

from fastapi import Depends
from fastapi.routing import APIRoute
from starlette.datastructures import MutableHeaders


@dataclass(frozen=True, slots=True, kw_only=True)
class Deprecation:
    """Since when a route should not be used, when it may be gone, and the page that says what to use instead."""

    since: date
    sunset: date
    page: str

    def __call__(self) -> None:
        """As a dependency of its route it does nothing: it is found there."""

    def tell(self, headers: MutableHeaders) -> None:
        """Add `Deprecation`, `Sunset` and their links to the headers of an answer."""
        headers["Deprecation"] = f"@{int(_midnight(self.since).timestamp())}"
        headers["Sunset"] = format_datetime(_midnight(self.sunset), usegmt=True)
        for relation in ("deprecation", "sunset"):
            headers.append("Link", f'<{self.page}>; rel="{relation}"; type="text/html"')


def deprecated(*, since: date, sunset: date, page: str) -> dict[str, Any]:
    """Arguments of a route, as in `@router.get("/old", **deprecated(since=…, sunset=…, page=…))`."""
    return {"deprecated": True, "dependencies": [Depends(Deprecation(since=since, sunset=sunset, page=page))]}


def tell_deprecation(route: APIRoute | None, headers: MutableHeaders) -> None:
    """Add to the headers of an answer what is to be said of its route, whoever has answered."""
    for dependency in () if route is None else route.dependencies:
        if isinstance(dependency.dependency, Deprecation):
            dependency.dependency.tell(headers)


def _midnight(day: date) -> datetime:
    return datetime.combine(day, time(), tzinfo=UTC)
