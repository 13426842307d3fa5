"""Makers whose actuators a house buys, and those that it buys rather than others."""

from collections.abc import Iterable, Mapping
from typing import ClassVar

from pydantic import Field

from gripwright.domain.assembly import Component
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import GripRequirement
from gripwright.domain.gripper import Actuator
from gripwright.domain.preference import INDIFFERENT, Preference
from gripwright.domain.shape import Segment
from gripwright.plugin_api import Params


class OnlyMakersParams(Params):
    """Which makers."""

    makers: tuple[str, ...] = Field((), description="Makers whose actuators may be bought, in any case of letters; none: all.")


class OnlyMakers:
    """Buy actuators of these makers alone."""

    key: ClassVar[str] = "only_makers"
    params_model: ClassVar[type[OnlyMakersParams]] = OnlyMakersParams

    def __init__(self, params: OnlyMakersParams) -> None:
        self._params = params

    def grip(
        self, component: Component, segment: Segment, requirement: GripRequirement, marks: Mapping[str, float]
    ) -> Rejection | Preference:
        """Grips are all the same to it."""
        return INDIFFERENT

    def actuator(self, actuator: Actuator) -> Rejection | Preference:
        """`maker-not-allowed` for every other maker."""
        makers = self._params.makers
        if not makers or _is_among(actuator.maker, makers):
            return INDIFFERENT
        return Rejection("maker-not-allowed", f"the maker is {actuator.maker}, only {', '.join(makers)} may be bought")


class PreferMakersParams(Params):
    """Which makers, and how much."""

    makers: tuple[str, ...] = Field((), description="Makers whose actuators are preferred, in any case of letters.")
    factor: float = Field(0.8, gt=0, le=1, description="Factor on the cost (price, or mass) of their actuators.")


class PreferMakers:
    """Take actuators of these makers rather than others, by a factor on their cost."""

    key: ClassVar[str] = "prefer_makers"
    params_model: ClassVar[type[PreferMakersParams]] = PreferMakersParams

    def __init__(self, params: PreferMakersParams) -> None:
        self._params = params

    def grip(
        self, component: Component, segment: Segment, requirement: GripRequirement, marks: Mapping[str, float]
    ) -> Rejection | Preference:
        """Grips are all the same to it."""
        return INDIFFERENT

    def actuator(self, actuator: Actuator) -> Rejection | Preference:
        """A factor below 1 for the makers that are preferred."""
        if not _is_among(actuator.maker, self._params.makers):
            return INDIFFERENT
        return Preference(factor=self._params.factor, detail=f"{actuator.maker} is preferred")


def _is_among(maker: str, makers: Iterable[str]) -> bool:
    return maker.casefold() in {name.casefold() for name in makers}
