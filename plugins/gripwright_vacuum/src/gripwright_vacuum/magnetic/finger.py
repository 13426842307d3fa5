"""The pole shoe of a magnet: mild steel from the component back to the magnet."""

from typing import ClassVar

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import SURFACE
from gripwright.domain.gripper import FingerDesign, FingerSpec
from gripwright.plugin_api import Params, RunContext
from gripwright_vacuum.flange import flange_around
from gripwright_vacuum.gripper_types import MAGNETIC_1

_STEEL, _DENSITY_KG_M3 = "steel S235JR (1.0038)", 7850.0


class PoleShoe:
    """A turned shoe in one piece: pole face, shank of the same width, and the flange on the magnet."""

    key: ClassVar[str] = "pole_shoe"
    params_model: ClassVar[type[Params]] = Params
    gripper_types: ClassVar[frozenset[str]] = frozenset({MAGNETIC_1})
    grips: ClassVar[frozenset[str]] = frozenset({SURFACE})

    def __init__(self, params: Params) -> None:
        self._params = params

    def design(self, spec: FingerSpec, ctx: RunContext) -> FingerDesign | Rejection:
        """The shoe for the opening width, or why the magnet has no room for its flange."""
        from gripwright.geometry import brep

        radius = spec.opening_max_mm / 2.0
        flange = flange_around(radius, spec)
        if isinstance(flange, Rejection):
            return flange
        shank = brep.cylinder_z(0.0, 0.0, radius, -spec.finger_length_mm, 0.0)
        whole = brep.single_solid(brep.fuse(shank, flange.solid(-spec.finger_length_mm)))
        volume = brep.measure(whole).volume_mm3
        return FingerDesign(
            brep=brep.write_brep(whole),
            mesh=brep.tessellate(whole),
            material=_STEEL,
            volume_mm3=volume,
            mass_kg=volume * 1e-9 * _DENSITY_KG_M3,
            properties={
                "finger_length_mm": spec.finger_length_mm,
                "pole_diameter_mm": spec.opening_max_mm,
                **flange.properties(),
            },
            name="pole shoe",
            bought=(flange.screws(spec.actuator.name),),
            notes=(
                "Pole face: the front, ground flat, Ra 0.8, its edge broken by 0.2 at most.",
                "Back of the flange faced, Ra 1.6: it carries the flux from the magnet.",
                "Mild steel, not hardened; no plating thicker than 10 µm on either face.",
            ),
        )
