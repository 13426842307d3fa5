"""Fields that a value has gained after values without them were stored."""

from collections.abc import Mapping
from types import MappingProxyType

LATER: Mapping[str, bool] = MappingProxyType({"later": True})
"""Metadata of such a field: a record holds it only where it differs from its default: the same content keeps its hash."""
