"""The conformance suite: which checks a plug-in of each kind must pass."""

import inspect
from collections.abc import Callable, Collection, Mapping, Sequence
from types import MappingProxyType, ModuleType
from typing import TYPE_CHECKING, Any

from gripwright.domain.shape import Primitive
from gripwright.plugin_api.checks import PROTOCOLS
from gripwright.testing import (
    affordance,
    fingers,
    fitters,
    general,
    hands,
    holding,
    optimizers,
    planners,
    policies,
    rules,
    segmenters,
)
from gripwright.testing.samples import Sample
from gripwright.testing.trial import Check, Finding, Trial

if TYPE_CHECKING:
    import pytest

TIME_LIMIT_S = 120.0
"""How long one check may take; the first pays for what the plug-in compiles."""

_KINDS: Mapping[str, ModuleType] = MappingProxyType(
    {
        "segmenter": segmenters,
        "fitter": fitters,
        "affordance": affordance,
        "rule": rules,
        "hand": hands,
        "planner": planners,
        "holding": holding,
        "optimizer": optimizers,
        "finger": fingers,
        "policy": policies,
    }
)
"""Kind → the module with its `cases` and `CHECKS`."""


def checks_for(kind: str) -> tuple[Check, ...]:
    """Every check of that kind; KeyError where there is no such kind."""
    return (*general.GATES, *general.CHECKS, *_KINDS[kind].CHECKS)


def check_plugin(
    plugin_class: Any,
    *,
    samples: Sequence[Sample | Primitive] = (),
    primitives: Collection[type] | None = None,
    time_limit_s: float = TIME_LIMIT_S,
) -> list[Finding]:
    """Every rule of the contract that the plug-in breaks; empty: none.

    What cannot be called, or does not answer, is not checked further. `samples` are asked besides the built-in ones:
    components of what looks at components, primitives of rules. `primitives` are the classes that manifests name as
    `PluginEntry.primitives`: an answer of any other than these and the built-in ones is a fault. None: that is not checked.
    """
    kind = kind_of(plugin_class)
    if kind is None:
        return [Finding("contract", f"{plugin_class!r} has the methods of no kind of plug-in: {', '.join(PROTOCOLS)}")]
    trial = _trial(plugin_class, kind, samples, primitives)
    for gate in general.GATES:
        if found := gate.findings(trial, time_limit_s):
            return found
    checks = (*general.CHECKS, *_KINDS[kind].CHECKS)
    return [finding for check in checks for finding in check.findings(trial, time_limit_s)]


def parametrize_with_checks(
    plugins: Sequence[Any],
    *,
    samples: Sequence[Sample | Primitive] = (),
    primitives: Collection[type] | None = None,
    time_limit_s: float = TIME_LIMIT_S,
) -> "pytest.MarkDecorator":
    """Parametrise a test by (plugin, check): `assert check(plugin) == []`. The others as of `check_plugin`, for all of them."""
    import pytest

    cases = [
        pytest.param(plugin, _bound(check, trial, time_limit_s), id=f"{plugin.__name__}-{check.name.replace(' ', '-')}")
        for plugin in plugins
        for trial in [_trial(plugin, _known_kind(plugin), samples, primitives)]
        for check in checks_for(trial.kind)
    ]
    return pytest.mark.parametrize(("plugin", "check"), cases)


def kind_of(plugin_class: Any) -> str | None:
    """The kind whose methods the class has, by name; None where it has none of any."""
    for kind, protocol in PROTOCOLS.items():
        names = {name for name, member in vars(protocol).items() if inspect.isfunction(member) and not name.startswith("_")}
        if any(hasattr(plugin_class, name) for name in names):
            return kind
    return None


def _known_kind(plugin_class: Any) -> str:
    kind = kind_of(plugin_class)
    if kind is None:
        raise TypeError(f"{plugin_class!r} has the methods of no kind of plug-in: {', '.join(PROTOCOLS)}")
    return kind


def _bound(check: Check, trial: Trial, time_limit_s: float) -> Callable[[Any], list[str]]:
    """The check of one plug-in, whose runs are made once, whichever check asks first."""
    return lambda plugin: [str(finding) for finding in check.findings(trial, time_limit_s)]


def _trial(plugin_class: Any, kind: str, samples: Sequence[Sample | Primitive], primitives: Collection[type] | None) -> Trial:
    return Trial(plugin_class, kind, _KINDS[kind].cases, tuple(samples), primitives)
