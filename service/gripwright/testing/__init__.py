"""For authors of plug-ins: sample components, a context, and the checks that say whether a plug-in keeps the contract."""

from gripwright.testing.checks import check_plugin, checks_for, kind_of, parametrize_with_checks
from gripwright.testing.samples import Sample, fake_context, sample_components
from gripwright.testing.trial import Check, Finding

__all__ = [
    "Check",
    "Finding",
    "Sample",
    "check_plugin",
    "checks_for",
    "fake_context",
    "kind_of",
    "parametrize_with_checks",
    "sample_components",
]
