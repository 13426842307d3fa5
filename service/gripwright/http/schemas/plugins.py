"""Plug-ins as callers see them."""

from typing import Any

from pydantic import BaseModel, Field

from gripwright.registry.description import PluginDescription


class PluginView(BaseModel):
    """An installed plug-in."""

    kind: str
    name: str
    version: str
    distribution: str
    summary: str
    options: dict[str, Any] = Field(description="JSON Schema of its parameters")
    warnings: list[str] = Field(description="what it uses of the plug-in contract that is deprecated")

    @classmethod
    def of(cls, plugin: PluginDescription) -> "PluginView":
        """The view of a plug-in; its key is its name."""
        return cls(
            kind=plugin["kind"],
            name=plugin["key"],
            version=plugin["version"],
            distribution=plugin["distribution"],
            summary=plugin["summary"],
            options=plugin["options"],
            warnings=plugin["warnings"],
        )


class PluginFailure(BaseModel):
    """A plug-in that did not load."""

    distribution: str
    plugin: str
    reason: str


class PluginList(BaseModel):
    """Everything installed."""

    items: list[PluginView]
    failures: list[PluginFailure]
    plan: dict[str, Any] = Field(
        description="JSON Schema of the options of a design; `x-plugins` is the kind of plug-ins that an option chooses. "
        "Parameters of a plug-in are options too, as `name.parameter`"
    )
