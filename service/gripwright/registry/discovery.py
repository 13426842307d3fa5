"""From installed distributions to a registry: entry points, static manifests, and a reason for everything that did not load."""

import dataclasses
import importlib
import importlib.metadata
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from typing import Any

from gripwright.plugin_api.checks import PROTOCOLS, contract_faults
from gripwright.plugin_api.deprecation import deprecations_of
from gripwright.plugin_api.manifest import API_VERSION, ENTRY_POINT_GROUP, KINDS, Manifest, PluginEntry

OWN_DISTRIBUTION = "gripwright"


@dataclass(frozen=True, slots=True, kw_only=True)
class InstalledPlugin:
    """A plug-in that may be used."""

    kind: str
    key: str
    plugin: Any  # a class that keeps the Protocol of `kind`, built as plugin(params)
    version: str
    distribution: str
    record_classes: tuple[type, ...] = ()
    samples: str = ""  # "module:function" of its own samples, which the checks import
    warnings: tuple[str, ...] = ()  # what it uses of the contract that is deprecated

    @property
    def name(self) -> str:
        """How results and messages name it."""
        return f"{self.kind}/{self.key}"


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadFailure:
    """A manifest of which nothing was loaded, and why."""

    distribution: str
    plugin: str  # "kind/key", or the entry point's name where the manifest itself failed
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Registry:
    """Everything installed: what can be used and what could not be loaded."""

    plugins: tuple[InstalledPlugin, ...]
    failures: tuple[LoadFailure, ...] = ()

    def find(self, kind: str, key: str) -> InstalledPlugin | None:
        """The plug-in of that kind and key."""
        return next((plugin for plugin in self.plugins if (plugin.kind, plugin.key) == (kind, key)), None)

    def keys(self, kind: str) -> list[str]:
        """Keys of that kind, sorted."""
        return sorted(plugin.key for plugin in self.plugins if plugin.kind == kind)


class PluginLoadError(Exception):
    """Strict loading met a failure, or the samples of a plug-in cannot be had."""


class _Unusable(Exception):
    """Why one manifest cannot be used: what failed, and the reason."""


def load_registry(
    *,
    allow: Collection[str] | None = None,
    kinds: Collection[str] = KINDS,
    strict: bool = False,
    on_load: Callable[[str], None] = lambda distribution: None,
) -> Registry:
    """Import the announced plug-ins of these kinds; all or nothing of each manifest. `allow` names distributions (None: all).

    `on_load` is told each distribution before anything of it is imported.
    """
    plugins: dict[str, InstalledPlugin] = {}
    failures: list[LoadFailure] = []
    for entry_point in _entry_points():
        distribution = _distribution(entry_point)
        if allow is not None and distribution not in allow:
            continue
        on_load(distribution)
        try:
            plugins.update(_load(entry_point, distribution, kinds, plugins))
        except _Unusable as unusable:
            plugin, reason = unusable.args
            failures.append(LoadFailure(distribution=distribution, plugin=plugin, reason=reason))
    if strict and failures:
        raise PluginLoadError("; ".join(f"{failure.distribution} {failure.plugin}: {failure.reason}" for failure in failures))
    return Registry(plugins=tuple(plugins.values()), failures=tuple(failures))


def _entry_points() -> Iterable[importlib.metadata.EntryPoint]:
    """Gripwright's own first, so that no other distribution can take its keys; then by name."""
    found = set(importlib.metadata.entry_points(group=ENTRY_POINT_GROUP))
    return sorted(found, key=lambda point: (_distribution(point) != OWN_DISTRIBUTION, _distribution(point), point.name))


def _distribution(entry_point: importlib.metadata.EntryPoint) -> str:
    return entry_point.dist.name if entry_point.dist is not None else "unknown"


def _load(
    entry_point: importlib.metadata.EntryPoint, distribution: str, kinds: Collection[str], taken: dict[str, InstalledPlugin]
) -> dict[str, InstalledPlugin]:
    manifest = _import(entry_point.value, entry_point.name)
    if not isinstance(manifest, Manifest):
        raise _Unusable(entry_point.name, f"{entry_point.value} is a {type(manifest).__name__}, not a Manifest")
    if not _speaks(manifest.api_version):
        raise _Unusable(
            entry_point.name,
            f"made for plug-in API {manifest.api_version}, this is {API_VERSION}: "
            f"versions from {API_VERSION.partition('.')[0]}.0 to {API_VERSION} load",
        )
    loaded: dict[str, InstalledPlugin] = {}
    for entry in manifest.plugins:
        if entry.kind not in KINDS:
            raise _Unusable(f"{entry.kind}/{entry.key}", f"there is no kind {entry.kind!r}; kinds are {', '.join(KINDS)}")
        if entry.kind not in kinds:
            continue
        plugin = _load_plugin(entry, manifest, distribution)
        holder = loaded.get(plugin.name) or taken.get(plugin.name)
        if holder is not None:
            raise _Unusable(plugin.name, f"the key is taken by {holder.distribution}")
        loaded[plugin.name] = plugin
    return loaded


def _load_plugin(entry: PluginEntry, manifest: Manifest, distribution: str) -> InstalledPlugin:
    name = f"{entry.kind}/{entry.key}"
    plugin = _import(entry.target, name)
    faults = contract_faults(plugin, entry.kind, entry.key)
    if faults:
        raise _Unusable(name, "; ".join(faults))
    primitives = tuple(_import(target, name) for target in entry.primitives)
    for target, primitive in zip(entry.primitives, primitives, strict=True):
        if not (isinstance(primitive, type) and dataclasses.is_dataclass(primitive)):
            raise _Unusable(name, f"primitive {target} is not a dataclass")
    return InstalledPlugin(
        kind=entry.kind,
        key=entry.key,
        plugin=plugin,
        version=manifest.version,
        distribution=distribution,
        record_classes=primitives,
        samples=entry.samples,
        warnings=deprecations_of(manifest, plugin, PROTOCOLS[entry.kind]),
    )


def load_samples(plugin: InstalledPlugin) -> tuple[Any, ...]:
    """What the checks ask a plug-in besides the built-in samples; PluginLoadError where its function does not give them."""
    if not plugin.samples:
        return ()
    try:
        return tuple(_import(plugin.samples, plugin.name)())
    except _Unusable as unusable:
        raise PluginLoadError(unusable.args[1]) from unusable
    except (Exception, SystemExit) as error:
        raise PluginLoadError(f"{plugin.samples} raises {type(error).__name__}: {error}") from error


def _import(target: str, name: str) -> Any:
    """The object at "module:attribute"; whatever its import does wrong is the reason."""
    module, _, attribute = target.partition(":")
    try:
        return getattr(importlib.import_module(module), attribute)
    except (Exception, SystemExit) as error:
        raise _Unusable(name, f"cannot import {target}: {type(error).__name__}: {error}") from error


def _speaks(version: str) -> bool:
    """Whether a plug-in made for `version` runs on this contract: same major, minor not newer."""
    try:
        major, minor = (int(number) for number in version.split("."))
    except (AttributeError, ValueError):
        return False
    own_major, own_minor = (int(number) for number in API_VERSION.split("."))
    return major == own_major and minor <= own_minor
