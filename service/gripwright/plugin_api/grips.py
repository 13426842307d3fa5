"""Which grips a planner or a finger designer serves."""

from gripwright.domain.grasp import EXTERNAL, INTERNAL

_JAWS = frozenset({EXTERNAL, INTERNAL})


def grips_of(plugin: object) -> frozenset[str]:
    """What its class variable `grips` names; without one the grips of jaws, from outside and from inside."""
    grips: frozenset[str] = getattr(plugin, "grips", _JAWS)
    return grips
