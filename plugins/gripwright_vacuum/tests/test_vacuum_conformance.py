"""Every plug-in of the distribution keeps the contract, and is announced as what it is."""

import importlib

from gripwright.plugin_api import PluginEntry
from gripwright.testing import kind_of, parametrize_with_checks
from gripwright_vacuum import manifest


def plugin_of(entry: PluginEntry) -> type:
    module, _, name = entry.target.partition(":")
    found: type = getattr(importlib.import_module(module), name)
    return found


PLUGINS = [plugin_of(entry) for entry in manifest.plugins]


@parametrize_with_checks(PLUGINS)
def test_it_keeps_the_contract(plugin, check):
    assert check(plugin) == []


def test_the_manifest_announces_each_as_what_it_is():
    assert [(entry.kind, entry.key) for entry in manifest.plugins] == [(kind_of(plugin), plugin.key) for plugin in PLUGINS]
