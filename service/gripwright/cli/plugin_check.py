"""The conformance suite in processes of their own: a plug-in that crashes or hangs ends its process, and is named."""

import faulthandler
import json
import os
import signal
import subprocess
import sys
from collections.abc import Collection, Iterator, Sequence

from gripwright.cli.compiling import tell_compiling
from gripwright.registry.discovery import InstalledPlugin, PluginLoadError, load_registry, load_samples
from gripwright.testing import Finding, check_plugin

_PATIENCE = 4.0
"""A plug-in is given up after so many time limits of one check: code outside Python does not notice the limit itself."""
_GIVEN_UP = 1
"""Exit code of faulthandler."""


def findings_in_children(
    names: Sequence[str], allow: Collection[str] | None, time_limit_s: float
) -> Iterator[tuple[str, list[str]]]:
    """Each plug-in with its findings, as they come. One process for all, and a new one after each that ends badly."""
    waiting = list(names)
    while waiting:
        request = {"names": waiting, "allow": None if allow is None else sorted(allow), "time_limit_s": time_limit_s}
        command = [sys.executable, "-m", "gripwright.cli.plugin_check", json.dumps(request)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as child:
            assert child.stdout is not None
            for line in child.stdout:
                found = json.loads(line)
                waiting.remove(found["name"])
                yield found["name"], found["findings"]
        if waiting:
            yield waiting.pop(0), [_ending(child.returncode, time_limit_s)]


def _ending(code: int, time_limit_s: float) -> str:
    if code == _GIVEN_UP:
        return f"crash: its process raised, or did not come back within {_PATIENCE * time_limit_s:g} s"
    cause = signal.Signals(-code).name if code < 0 else f"code {code}"
    return f"crash: its process ended with {cause} during the checks"


def main(request: str) -> None:
    """Check the plug-ins that a request names; one line of JSON each. What they print themselves is not shown."""
    asked = json.loads(request)
    answers, errors = os.fdopen(os.dup(1), "w"), os.fdopen(os.dup(2), "w")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(nowhere, stream)
    tell_compiling(lambda message: print(message, file=errors, flush=True))
    registry = load_registry(allow=asked["allow"])
    installed = {plugin.name: plugin for plugin in registry.plugins}
    primitives = frozenset(cls for plugin in registry.plugins for cls in plugin.record_classes)
    for name in asked["names"]:
        faulthandler.dump_traceback_later(_PATIENCE * asked["time_limit_s"], exit=True)
        findings = [str(finding) for finding in _findings(installed[name], primitives, asked["time_limit_s"])]
        print(json.dumps({"name": name, "findings": findings}), file=answers, flush=True)


def _findings(plugin: InstalledPlugin, primitives: Collection[type], time_limit_s: float) -> list[Finding]:
    try:
        samples = load_samples(plugin)
    except PluginLoadError as error:
        return [Finding("samples", str(error))]
    return check_plugin(plugin.plugin, samples=samples, primitives=primitives, time_limit_s=time_limit_s)


if __name__ == "__main__":
    main(sys.argv[1])
