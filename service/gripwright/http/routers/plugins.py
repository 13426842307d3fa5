"""What is installed."""

from fastapi import APIRouter

from gripwright.domain.errors import NotFound
from gripwright.http.deps import Plugins
from gripwright.http.schemas.plugins import PluginFailure, PluginList, PluginView
from gripwright.http.schemas.problem import problems

router = APIRouter(prefix="/plugins", tags=["plug-ins"])


@router.get("", operation_id="list_plugins", responses=problems(503))
def list_plugins(plugins: Plugins) -> PluginList:
    """Every plug-in with the JSON Schema of its options, and those that did not load, with the reason."""
    return PluginList(
        items=[PluginView.of(plugin) for plugin in plugins["plugins"]],
        failures=[PluginFailure(**failure) for failure in plugins["failures"]],
    )


@router.get("/{kind}/{name}", operation_id="get_plugin", responses=problems(404, 503))
def get_plugin(kind: str, name: str, plugins: Plugins) -> PluginView:
    """One plug-in."""
    for plugin in plugins["plugins"]:
        if (plugin["kind"], plugin["key"]) == (kind, name):
            return PluginView.of(plugin)
    raise NotFound(f"no {kind} {name} is installed", kind=kind, name=name)
