"""How a magnet holds: by the area of its pole, as far as the component carries its flux."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import Field

from gripwright.domain.assembly import Component
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import Grasp, Hold
from gripwright.domain.gripper import Actuator
from gripwright.domain.holding import Contact, Load
from gripwright.geometry.held_surface import Surface
from gripwright.plugin_api import HandModel, Params, RunContext
from gripwright_vacuum.face_force import by_area_N
from gripwright_vacuum.gripper_types import MAGNETIC_1
from gripwright_vacuum.statics import DISC_CORE, needed_hold
from gripwright_vacuum.surface_texture import TextureSettings
from gripwright_vacuum.touching import sealed, seated, thickness_mm


class MagneticSettings(TextureSettings):
    """What the component does to the magnet's force."""

    saturation: float = Field(
        0.25,
        gt=0,
        le=2,
        description="thickness of the component, as a share of the pole's diameter, from which on it carries all of the flux",
    )


class MagneticHolding:
    """The magnetic force that is needed, by what the catalogue states on thick, smooth steel.

    The flux of a round pole leaves it sideways through the component: a quarter of its diameter has the pole's own section. A
    thinner component carries less in proportion, which the contact's area says. Texture counts as an air gap.
    """

    key: ClassVar[str] = "magnetic"
    params_model: ClassVar[type[Params]] = MagneticSettings
    gripper_types: ClassVar[frozenset[str]] = frozenset({MAGNETIC_1})

    def __init__(self, params: MagneticSettings) -> None:
        self._params = params

    def seat(self, grasp: Grasp, surface: Surface, hand: HandModel, ctx: RunContext) -> Grasp | Rejection:
        """The grasp whose pole just touches."""
        return seated(grasp, surface)

    def contacts(
        self, grasp: Grasp, surface: Surface, hand: HandModel, finger_length_mm: float, ctx: RunContext
    ) -> Sequence[Contact] | Rejection:
        """The area of the pole whose flux the component carries, where all of it lies on flat surface."""
        found = sealed(grasp, surface, "pole")
        if isinstance(found, Rejection):
            return found
        width = grasp.opening_width_mm
        thick = self._params.saturation * width
        carried = thickness_mm(grasp, surface, thick) / thick
        return [
            Contact(
                height_mm=width,
                area_mm2=float(carried * np.pi / 4.0 * width**2),
                centre_C=grasp.X_CG[:3, 3],
                normal_C=-grasp.X_CG[:3, 2],
                gap_mm=found.gap_mm,
            )
        ]

    def hold(
        self, grasp: Grasp, contacts: Sequence[Contact], load: Load, component: Component, ctx: RunContext
    ) -> Hold | Rejection:
        """The force that holds; none does what is not known to be ferrous."""
        if not component.ferrous:
            said = "is not ferrous" if component.ferrous is False else "is not said to be `ferrous` in the product"
            return Rejection("not-held", f"no magnet holds it: {component.id} {said}")
        radius = grasp.opening_width_mm / 2.0
        carried = contacts[0].area_mm2 / (np.pi * radius**2)
        return needed_hold(
            grasp,
            contacts[0],
            load,
            component.friction,
            radius_mm=radius,
            core=DISC_CORE,
            factor=self._params.factor(component) / carried,
        )

    def grip_force_N(self, actuator: Actuator, opening_width_mm: float) -> float | None:
        """The force of a pole face of that size: by its area, from that of the largest."""
        return by_area_N(actuator, opening_width_mm)
