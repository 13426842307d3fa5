"""The suction cup with its holder: the cup is bought, the holder is made."""

from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from pydantic import Field

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import SURFACE
from gripwright.domain.gripper import BondedFinger, BoughtPart, FingerDesign, FingerSpec, MadePart
from gripwright.plugin_api import Params, RunContext
from gripwright_vacuum.flange import Flange, flange_around
from gripwright_vacuum.gripper_types import VACUUM_1
from gripwright_vacuum.vacuum.cup import CupMeasures

if TYPE_CHECKING:  # the CAD kernel takes most of a second
    from gripwright.geometry import brep

_RUBBERS = {"nbr": ("NBR", 1300.0), "silicone": ("silicone rubber", 1200.0), "polyurethane": ("polyurethane", 1200.0)}
_ALUMINIUM = ("aluminium EN AW-6082-T6", 2700.0)


class SuctionCupSettings(Params):
    """What cups are made of."""

    rubber: Literal["nbr", "silicone", "polyurethane"] = Field("nbr", description="of the cup: NBR where there is oil")


class SuctionCup:
    """A flat cup on a turned holder, through which its air goes, with a flange that seals on the actuator.

    `finger.*` show both; the holder alone is `finger_bare.*`, the cup `pad.*`, drawn for reference with a maker's usual measures.
    """

    key: ClassVar[str] = "suction_cup"
    params_model: ClassVar[type[Params]] = SuctionCupSettings
    gripper_types: ClassVar[frozenset[str]] = frozenset({VACUUM_1})
    grips: ClassVar[frozenset[str]] = frozenset({SURFACE})

    def __init__(self, params: SuctionCupSettings) -> None:
        self._params = params

    def design(self, spec: FingerSpec, ctx: RunContext) -> FingerDesign | Rejection:
        """Cup and holder for the opening width, or why the holder cannot be made."""
        from gripwright.geometry import brep

        cup = CupMeasures(diameter_mm=spec.opening_max_mm)
        if spec.finger_length_mm < cup.length_min_mm - 1e-9:
            return Rejection(
                "finger-too-short",
                f"a cup of {cup.diameter_mm:g} mm and its stud need {cup.length_min_mm:.2f} mm, "
                f"there are {spec.finger_length_mm:.2f} mm",
            )
        flange = flange_around(cup.stem_radius_mm, spec)
        if isinstance(flange, Rejection):
            return flange
        rubber, density = _RUBBERS[self._params.rubber]
        holder = _part(_holder(cup, flange, spec.finger_length_mm), *_ALUMINIUM)
        bought = _part(_cup(cup), rubber, density)
        whole = brep.single_solid(brep.fuse(brep.read_brep(holder.brep), brep.read_brep(bought.brep)))
        thread = cup.thread
        return FingerDesign(
            brep=brep.write_brep(whole),
            mesh=brep.tessellate(whole),
            material=holder.material,
            volume_mm3=brep.measure(whole).volume_mm3,
            mass_kg=holder.mass_kg + bought.mass_kg,
            properties={
                "finger_length_mm": spec.finger_length_mm,
                "cup_diameter_mm": cup.diameter_mm,
                "stem_diameter_mm": 2.0 * cup.stem_radius_mm,
                "air_bore_mm": 2.0 * thread.bore_radius_mm,
                **flange.properties(),
            },
            bonded=BondedFinger(
                bare=holder,
                pad=bought,
                pad_size_mm=(cup.height_mm, cup.diameter_mm, cup.diameter_mm),
                adhesive="",
                bought=BoughtPart(
                    item="suction cup",
                    designation=f"flat suction cup {cup.diameter_mm:g} mm, {rubber}, {thread.name} male",
                    description=f"screwed into the cup holder; height {cup.height_mm:.1f} mm",
                    material=rubber,
                    mass_kg=round(bought.mass_kg, 6),
                ),
            ),
            name="cup holder",
            bought=(flange.screws(spec.actuator.name), _ring(thread.bore_radius_mm, spec.actuator.name)),
            notes=(
                f"Front: thread {thread.name}, {thread.length_mm:g} deep, for the cup; faced for its seal.",
                f"Air bore ⌀{2.0 * thread.bore_radius_mm:g} through; back faced, Ra 1.6, seals by an O-ring.",
                f"Cup: flat, {cup.diameter_mm:g} mm, {rubber}, bought, drawn for reference.",
                "Holder without cup: finger_bare.step. Turned; edges broken.",
            ),
        )


def _holder(cup: CupMeasures, flange: Flange, length_mm: float) -> "brep.Shape":
    from gripwright.geometry import brep

    thread, front, seat = cup.thread, -cup.height_mm, -cup.height_mm - cup.thread.length_mm
    stem = brep.cylinder_z(0.0, 0.0, cup.stem_radius_mm, -length_mm, front)
    whole = brep.fuse(stem, flange.solid(-length_mm))
    bore = brep.cylinder_z(0.0, 0.0, thread.bore_radius_mm, -length_mm - flange.thickness_mm - 1.0, front + 1.0)
    return brep.single_solid(brep.cut(whole, [bore, brep.cylinder_z(0.0, 0.0, thread.radius_mm, seat, front + 1.0)]))


def _cup(cup: CupMeasures) -> "brep.Shape":
    """Lip, collar and stud, hollow for the air."""
    from gripwright.geometry import brep

    thread, radius, lip, height = cup.thread, cup.diameter_mm / 2.0, cup.lip_height_mm, cup.height_mm
    wall = cup.lip_thickness_mm
    outside = brep.fuse(
        brep.cone_z(0.0, 0.0, (cup.neck_radius_mm, radius), -lip, 0.0),
        brep.cylinder_z(0.0, 0.0, cup.neck_radius_mm, -height, -lip),
    )
    outside = brep.fuse(outside, brep.cylinder_z(0.0, 0.0, thread.radius_mm, -height - thread.length_mm, -height))
    hollow = (max(cup.neck_radius_mm - wall, thread.bore_radius_mm), radius - 0.6 * wall)
    tools = [
        brep.cone_z(0.0, 0.0, hollow, wall - lip, 0.0),
        brep.cylinder_z(0.0, 0.0, thread.bore_radius_mm, -height - thread.length_mm - 1.0, 1.0),
    ]
    return brep.single_solid(brep.cut(outside, tools))


def _part(shape: "brep.Shape", material: str, density_kg_m3: float) -> MadePart:
    from gripwright.geometry import brep

    mass = brep.measure(shape).volume_mm3 * 1e-9 * density_kg_m3
    return MadePart(brep=brep.write_brep(shape), mesh=brep.tessellate(shape), material=material, mass_kg=mass)


def _ring(bore_radius_mm: float, actuator: str) -> BoughtPart:
    inner = float(np.ceil(2.0 * bore_radius_mm + 2.0))
    return BoughtPart(
        item="O-ring",
        designation=f"O-ring {inner:g} x 1.5, NBR 70",
        description=f"between flange and {actuator}, around the air bore",
        material="NBR",
    )
