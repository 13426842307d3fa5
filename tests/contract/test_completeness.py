"""A Protocol of the contract is there for authors: it is described, checked, begun with a template, and really used."""

import inspect
from collections.abc import Collection, Mapping
from importlib.resources import files
from pathlib import Path
from typing import ClassVar, Protocol

import pytest

from example_plugins import install_examples
from gripwright import plugin_api
from gripwright.plugin_api import contracts
from gripwright.plugin_api.checks import PROTOCOLS
from gripwright.registry.discovery import OWN_DISTRIBUTION, load_registry
from gripwright.testing import checks_for

DOCS = Path(__file__).resolve().parents[2] / "docs/plugins"
CONTRACT, TESTING = ((DOCS / name).read_text(encoding="utf-8") for name in ("contract.md", "testing.md"))


def methods_of(protocol: type) -> set[str]:
    return {name for name, member in vars(protocol).items() if inspect.isfunction(member) and not name.startswith("_")}


def protocols() -> dict[str, type]:
    members = inspect.getmembers(contracts, inspect.isclass)
    return {name: member for name, member in members if member.__module__ == contracts.__name__ and name != "Plugin"}


def own_checks(kind: str) -> set[str]:
    """Names of the checks that only this kind has; none where there is no such kind."""
    try:
        names = [{check.name for check in checks_for(other)} for other in PROTOCOLS]
        return {check.name for check in checks_for(kind)} - set.intersection(*names)
    except KeyError:
        return set()


def lacking(name: str, protocol: type, kinds: Mapping[str, type], users: Mapping[str, Collection[type]]) -> list[str]:
    """What a Protocol lacks; `users` are the classes of the plug-ins that there are, by kind."""
    kind = next((kind for kind, other in kinds.items() if other is protocol), None)
    lacks = []
    if f"\n## {name}\n" not in CONTRACT:
        lacks.append(f"{name} has no section in contract.md")
    if name not in plugin_api.__all__:
        lacks.append(f"{name} is not public")
    if kind is None:  # a further ability of plug-ins of some kind
        if not any(methods_of(protocol) & {check.name for check in checks_for(other)} for other in PROTOCOLS):
            lacks.append(f"{name} has no conformance check")
        if not any(all(hasattr(user, method) for method in methods_of(protocol)) for found in users.values() for user in found):
            lacks.append(f"{name} has no real user")
        return lacks
    if not own_checks(kind):
        lacks.append(f"{name} has no conformance check")
    if f"\n| {kind} | **" not in TESTING:
        lacks.append(f"{name} has no row of checks in testing.md")
    if not (files("gripwright.cli") / f"project/kinds/{kind}.py.txt").is_file():
        lacks.append(f"{name} has no template for `plugins new`")
    if not users.get(kind):
        lacks.append(f"{name} has no real user")
    return lacks


@pytest.fixture(scope="module")
def users(tmp_path_factory) -> dict[str, list[type]]:
    """The classes of all plug-ins that are built in or come as an example, by kind."""
    with pytest.MonkeyPatch.context() as patch:
        site = tmp_path_factory.mktemp("site")
        names, path = install_examples(site)
        for folder in path.split(":"):
            patch.syspath_prepend(folder)
        registry = load_registry(allow=(OWN_DISTRIBUTION, *names), strict=True)
    return {kind: [plugin.plugin for plugin in registry.plugins if plugin.kind == kind] for kind in PROTOCOLS}


@pytest.mark.parametrize("name", sorted(protocols()))
def test_every_protocol_is_described_checked_begun_and_used(name, users):
    assert lacking(name, protocols()[name], PROTOCOLS, users) == []


def test_a_protocol_of_which_nobody_thought_is_found(users):
    class Unheard(Protocol):
        key: ClassVar[str]

        def listen(self) -> None: ...

    assert lacking("Unheard", Unheard, {**PROTOCOLS, "ear": Unheard}, users) == [
        "Unheard has no section in contract.md",
        "Unheard is not public",
        "Unheard has no conformance check",
        "Unheard has no row of checks in testing.md",
        "Unheard has no template for `plugins new`",
        "Unheard has no real user",
    ]
    assert lacking("Unheard", Unheard, PROTOCOLS, users) == [
        "Unheard has no section in contract.md",
        "Unheard is not public",
        "Unheard has no conformance check",
        "Unheard has no real user",
    ]


def test_every_kind_of_a_manifest_has_its_protocol():
    assert tuple(PROTOCOLS) == plugin_api.manifest.KINDS
