"""A finger as it touches, and the two parts that it is bonded of where it has a pad."""

from typing import TYPE_CHECKING

import numpy as np

from gripwright.domain.gripper import BondedFinger, FingerDesign, MadePart
from gripwright.domain.pad import RUBBERS, Pad
from gripwright_builtin.fingers.materials import Material
from gripwright_builtin.fingers.stem import PadStrip

if TYPE_CHECKING:  # the CAD kernel takes most of a second, and most designs that are repeated make no finger
    from gripwright.geometry import brep


def bonded_finger(
    whole: "brep.Shape", strip: PadStrip | None, material: Material, pad: Pad, step_rad: float, figures: dict[str, float]
) -> FingerDesign:
    """The design of a finger of that whole shape whose part `strip` is its pad; `step_rad` is of the meshes.

    Mass and centre of mass (finger frame) are those of both; the latter is added to the figures.
    """
    from gripwright.geometry import brep

    solids = [(brep.cut(whole, [] if strip is None else [strip.solid]), material.name, material.density_kg_m3)]
    if strip is not None:
        solids.append((strip.solid, pad.material, RUBBERS[pad.rubber].density_kg_m3))
    parts = [_part(brep.single_solid(shape), name, density_kg_m3, step_rad) for shape, name, density_kg_m3 in solids]
    masses = np.array([part.mass_kg for part in parts])
    centre = masses @ np.array([brep.measure(shape).centre_of_mass_mm for shape, _, _ in solids]) / masses.sum()
    return FingerDesign(
        brep=brep.write_brep(whole),
        mesh=brep.tessellate(whole, angle_rad=step_rad),
        material=material.name,
        volume_mm3=brep.measure(whole).volume_mm3,
        mass_kg=float(masses.sum()),
        properties=figures | dict(zip(("com_x_mm", "com_y_mm", "com_z_mm"), centre.round(6).tolist(), strict=True)),
        bonded=None if strip is None else _bonded(parts[0], parts[1], strip, pad),
    )


def _bonded(bare: MadePart, rubber: MadePart, strip: PadStrip, pad: Pad) -> BondedFinger:
    return BondedFinger(bare=bare, pad=rubber, pad_size_mm=strip.size_mm, adhesive=RUBBERS[pad.rubber].adhesive)


def _part(shape: "brep.Shape", material: str, density_kg_m3: float, step_rad: float) -> MadePart:
    from gripwright.geometry import brep

    return MadePart(
        brep=brep.write_brep(shape),
        mesh=brep.tessellate(shape, angle_rad=step_rad),
        material=material,
        mass_kg=brep.measure(shape).volume_mm3 * 1e-9 * density_kg_m3,
    )
