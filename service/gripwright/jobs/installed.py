"""The plug-ins of this process. Only children that run steps, and the server they are forked from, ever load them."""

from functools import cache

from gripwright.registry.discovery import Registry, load_registry


@cache
def installed_registry(allow: tuple[str, ...] | None) -> Registry:
    """Everything installed, loaded once a process."""
    return load_registry(allow=allow)
