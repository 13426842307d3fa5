"""What a house policy thinks of something that it allows."""

import math
from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Preference:
    """Rather this than others where `factor` is below 1, rather others where it is above; `detail` says why."""

    factor: float = 1.0
    detail: str = ""
    policy: str = ""  # key of the policy; the host fills it in

    def __post_init__(self) -> None:
        if not 0.0 < self.factor < math.inf:
            raise ValueError(f"a preference's factor is {self.factor}, a finite number above 0 is needed")

    def __str__(self) -> str:
        return f"policy {self.policy}, factor {self.factor:g}: {self.detail}"


INDIFFERENT = Preference()
"""The answer of a policy to what it does not care about."""


def weight(preferences: Iterable[Preference]) -> float:
    """The factors of several policies together."""
    return math.prod(preference.factor for preference in preferences)
