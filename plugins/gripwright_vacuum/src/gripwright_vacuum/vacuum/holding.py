"""How a suction cup holds: suction against pull, peeling, shear and torsion, with a margin for what leaks."""

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
from gripwright_vacuum.gripper_types import VACUUM_1
from gripwright_vacuum.statics import RING_CORE, needed_hold
from gripwright_vacuum.surface_texture import TextureSettings
from gripwright_vacuum.touching import sealed, seated


class VacuumSettings(TextureSettings):
    """How much of the cup's area holds, and what leaks."""

    effective: float = Field(0.9, gt=0, le=1, description="diameter within which there is vacuum, as a share of the lip's")


class VacuumHolding:
    """The suction that is needed, by the cup's nominal area: what the catalogue states for an actuator too.

    Vacuum acts on the effective area alone, and leaks the more the rougher the surface: both raise the suction that is asked for.
    The lip presses on a ring, which peels where the moment exceeds half its radius times the pressing force.
    """

    key: ClassVar[str] = "vacuum"
    params_model: ClassVar[type[Params]] = VacuumSettings
    gripper_types: ClassVar[frozenset[str]] = frozenset({VACUUM_1})

    def __init__(self, params: VacuumSettings) -> None:
        self._params = params

    def seat(self, grasp: Grasp, surface: Surface, hand: HandModel, ctx: RunContext) -> Grasp | Rejection:
        """The grasp whose lip just touches."""
        return seated(grasp, surface)

    def contacts(
        self, grasp: Grasp, surface: Surface, hand: HandModel, finger_length_mm: float, ctx: RunContext
    ) -> Sequence[Contact] | Rejection:
        """The effective area, where the cup lies on flat surface with all of its own, without a hole."""
        found = sealed(grasp, surface, "cup")
        if isinstance(found, Rejection):
            return found
        diameter = self._params.effective * grasp.opening_width_mm
        return [
            Contact(
                height_mm=grasp.opening_width_mm,
                area_mm2=float(np.pi / 4.0 * diameter**2),
                centre_C=grasp.X_CG[:3, 3],
                normal_C=-grasp.X_CG[:3, 2],
                gap_mm=found.gap_mm,
            )
        ]

    def hold(
        self, grasp: Grasp, contacts: Sequence[Contact], load: Load, component: Component, ctx: RunContext
    ) -> Hold | Rejection:
        """The suction that holds, leak margin included."""
        share = self._params.effective
        return needed_hold(
            grasp,
            contacts[0],
            load,
            component.friction,
            radius_mm=share * grasp.opening_width_mm / 2.0,
            core=RING_CORE,
            factor=self._params.factor(component) / share**2,
        )

    def grip_force_N(self, actuator: Actuator, opening_width_mm: float) -> float | None:
        """The suction of a cup of that size: by its area, from that of the largest."""
        return by_area_N(actuator, opening_width_mm)
