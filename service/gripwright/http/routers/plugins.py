"""What is installed."""

from fastapi import APIRouter, Response

from gripwright.domain.errors import NotFound
from gripwright.http.deps import Plugins
from gripwright.http.reading import NOT_MODIFIED, Whole
from gripwright.http.schemas.plugins import PluginFailure, PluginList, PluginView
from gripwright.http.schemas.problem import problems
from gripwright.registry.plans import plan_schema

router = APIRouter(prefix="/plugins", tags=["plug-ins"])


@router.get("", operation_id="list_plugins", response_model=PluginList, responses={**NOT_MODIFIED, **problems(503)})
def list_plugins(plugins: Plugins, whole: Whole) -> Response:
    """Every plug-in with the JSON Schema of its options, and those that did not load, with the reason; the schema of a plan."""
    return whole.answer(
        PluginList(
            items=[PluginView.of(plugin) for plugin in plugins["plugins"]],
            failures=[PluginFailure(**failure) for failure in plugins["failures"]],
            plan=plan_schema(),
        )
    )


@router.get(
    "/{kind}/{name}", operation_id="get_plugin", response_model=PluginView, responses={**NOT_MODIFIED, **problems(404, 503)}
)
def get_plugin(kind: str, name: str, plugins: Plugins, whole: Whole) -> Response:
    """One plug-in."""
    for plugin in plugins["plugins"]:
        if (plugin["kind"], plugin["key"]) == (kind, name):
            return whole.answer(PluginView.of(plugin))
    raise NotFound(f"no {kind} {name} is installed", kind=kind, name=name)
