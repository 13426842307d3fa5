"""Which route a request is for, known before it gets there: what is refused or answered again on the way has a route, too."""

from collections.abc import Iterable

from fastapi import APIRouter
from fastapi.routing import APIRoute
from starlette.types import Scope


class Places:
    """The routes of routers, each under its prefix, in the order in which the application tries them."""

    def __init__(self, routers: Iterable[tuple[str, APIRouter]]) -> None:
        self._routes = [(prefix, [route for route in router.routes if isinstance(route, APIRoute)]) for prefix, router in routers]

    def mark(self, scope: Scope) -> None:
        """Set `route` and `path_params` as routing will; of a path that takes other methods alone, too."""
        method = "GET" if scope["method"] == "HEAD" else scope["method"]
        for prefix, routes in self._routes:
            if not scope["path"].startswith(prefix):
                continue
            path = scope["path"][len(prefix) :]
            for route in routes:
                match = route.path_regex.match(path)
                if match is None:
                    continue
                is_meant = method in (route.methods or ())
                if is_meant or "route" not in scope:
                    scope.update(route=route, path_params=match.groupdict())
                if is_meant:
                    return
