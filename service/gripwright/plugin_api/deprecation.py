"""Members of the contract that are on their way out: they work until the next major version, and their users are told."""

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from gripwright.plugin_api.manifest import Manifest


@dataclass(frozen=True, slots=True, kw_only=True)
class Deprecation:
    """A member of the manifest, or of a Protocol, that plug-ins should not have any more."""

    owner: str  # "Manifest", or the name of a Protocol
    member: str
    since: str  # version of the contract
    instead: str

    def __str__(self) -> str:
        gone = int(self.since.partition(".")[0]) + 1
        return f"{self.owner}.{self.member} is deprecated since plug-in API {self.since} and gone in {gone}.0: {self.instead}"


DEPRECATIONS = (
    Deprecation(owner="Manifest", member="name", since="1.2", instead="leave it out, the distribution's own name is used"),
)


def deprecations_of(
    manifest: Manifest, plugin: Any, protocol: type, known: Iterable[Deprecation] = DEPRECATIONS
) -> tuple[str, ...]:
    """What of the manifest and of a plug-in's class is deprecated, a sentence each."""
    given = {
        field.name
        for field in dataclasses.fields(manifest)
        if field.default is not dataclasses.MISSING and getattr(manifest, field.name) != field.default
    }
    return tuple(
        str(one)
        for one in known
        if (one.owner == "Manifest" and one.member in given) or (one.owner == protocol.__name__ and hasattr(plugin, one.member))
    )
