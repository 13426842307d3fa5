"""Builds the sample product: a coolant pump at 55 % scale, assembled on a pallet with three nests. Our own CAD.

Needs the development extra `samples` (build123d, bd-warehouse); the results are committed beside it in `pump/`:

    python -m gripwright.samples.build_pump

Three groups stand on the pallet: the pump head on the product frame's axis, the drive shaft at x = −220, the gear train
at x = +220. z = 0 is the pallet's surface. Each `make_…` function models one component in a frame of its own,
and `COMPONENTS` places it. Lengths in mm.
"""
# mypy: disable-error-code="import-not-found"

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from bd_warehouse.gear import SpurGear
from bd_warehouse.thread import IsoThread
from build123d import (
    Align,
    Box,
    Cylinder,
    Location,
    Part,
    Pos,
    RegularPolygon,
    Rot,
    export_step,
    export_stl,
    extrude,
)

OUTPUT = Path(__file__).parent / "pump"
STEEL, ALUMINIUM = 7850.0, 2700.0  # kg/m³
FINE, MEDIUM = 3.0001, 5.0001  # degrees: 120 or 72 chords a circle, divisible by 3, sagitta at most 0.03 mm
SHAFT_X, GEAR_X = -220.0, 220.0
KEY_X = 10.0  # off the carrier's axis
GEAR_MODULE, GEAR_TEETH, PINION_TEETH = 1.25, 40, 15

Point = tuple[float, float, float]
FLAT = (Align.CENTER, Align.CENTER, Align.MIN)


@dataclass(frozen=True)
class Marked:
    """A box, in the component's frame, in which no finger may touch it."""

    reason: str
    low: Point
    high: Point


@dataclass(frozen=True)
class Made:
    """A component: how it is modelled, where it stands in the product, and from how far above it is lowered."""

    id: str
    name: str
    make: Callable[[], Part]
    place: Location
    density: float
    lift: float
    no_grasp: tuple[Marked, ...] = ()
    facet_deg: float = MEDIUM


def disc(diameter: float, low: float, high: float) -> Part:
    """A solid cylinder on the z axis between two levels."""
    return Pos(0, 0, low) * Cylinder(diameter / 2.0, high - low, align=FLAT)


def block(x: float, y: float, low: float, high: float) -> Part:
    """A solid block centred on the z axis between two levels."""
    return Pos(0, 0, low) * Box(x, y, high - low, align=FLAT)


def make_coolant_cover() -> Part:
    """Disc Ø124.9 with a spigot on either side; the upper one is the rotor's stepped bearing."""
    body = disc(124.9, 0, 8) + disc(40, -24, 32)
    return body - disc(24.1, 14, 32) - disc(16.1, -9, 14)


def make_front_cover() -> Part:
    """Flange Ø118 with a cup over the spigot, and the outlet through the cup's wall."""
    body = disc(118, 0, 10) + disc(100, 10, 34)
    outlet = Pos(0, 45, 22) * Rot(90, 0, 0) * Cylinder(6, 20)
    return body - disc(80, 10, 34) - disc(40.2, 0, 10) - outlet


def make_rotor() -> Part:
    """Six coaxial segments, modelled with the collar down; the keyway is in the collar's face."""
    vanes = block(44, 44, 34, 41.5) & disc(60, 34, 41.5)
    for turn in range(8):
        vanes -= Rot(0, 0, 22.5 + 45.0 * turn) * Pos(29, 0, 34) * Box(20, 4, 7.5, align=FLAT)
    body = disc(50, 0, 8) + disc(30, 8, 24) + disc(60.5, 24, 32) + disc(24, 32, 34)
    body += vanes + disc(24, 41.5, 60) + disc(16, 60, 82)
    return body - Pos(KEY_X, 0, 0) * Box(12, 4.5, 3, align=FLAT)


def make_carrier() -> Part:
    """Flange Ø55 under a hub, with a pocket off its axis, which the key is sunk in, over a keyway."""
    pocket = Pos(KEY_X, 0, 1.5) * Box(12, 24, 28.5, align=FLAT)
    keyway = Pos(KEY_X, 0, 0) * Box(12, 4.5, 2, align=FLAT)
    return disc(55, 0, 8) + disc(44, 8, 30) - pocket - keyway


def make_inner_sleeve() -> Part:
    """A journal Ø10 on a body Ø22."""
    return disc(22, 0, 16) + disc(10, 16, 40)


def make_shaft() -> Part:
    """Ø16.5, hollow at its foot, with a thread M10 × 20 at its head; modelled lying, its axis along +x."""
    thread = IsoThread(major_diameter=10, pitch=1.5, length=20, external=True, end_finishes=("fade", "fade"))
    core = disc(16.5, 0, 44) + disc(2 * thread.min_radius, 44, 64) - disc(10.1, 0, 24.5)
    return Rot(0, 90, 0) * (core + Pos(0, 0, 44) * thread)


def make_gear_block() -> Part:
    """A square of 24 mm across flats under a pinion."""
    pinion = SpurGear(GEAR_MODULE, PINION_TEETH, 20, 7, align=FLAT)
    return block(24, 24, 0, 14) + Pos(0, 0, 14) * pinion


def make_sleeve() -> Part:
    """A thin bush Ø19 for the shaft."""
    return disc(19, 0, 40) - disc(16.6, 0, 40)


def make_boss_block() -> Part:
    """A block of 33 × 60 with the gear's journal Ø26 on it, modelled with its long side along x."""
    return Pos(-14, 0, 0) * block(60, 33, 0, 12) + disc(26, 12, 36)


def make_gear() -> Part:
    """Involute teeth, a relief, and a flange Ø53 that is a little wider than they are."""
    teeth = SpurGear(GEAR_MODULE, GEAR_TEETH, 20, 17, align=FLAT)
    return disc(53, 0, 8) + disc(42, 8, 10) + Pos(0, 0, 10) * teeth - disc(26.1, 0, 27)


def make_key() -> Part:
    """A square-ended key of 4.4 mm, modelled lying on its side."""
    return Box(11.8, 9, 4.4, align=FLAT)


def make_nut() -> Part:
    """A thin hexagon of 19.8 mm across flats, its bore at the thread's major diameter (the thread is not modelled)."""
    return extrude(RegularPolygon(19.8 / 2.0, 6, major_radius=False), 5) - disc(10.2, 0, 5)


def make_flanged_sleeve() -> Part:
    """Ø14 over a low flange."""
    return disc(17, 0, 1.2) + disc(14, 1.2, 5) - disc(10.2, 0, 5)


def make_pallet() -> Part:
    """The assembly pallet with a nest for each group."""
    plate = Pos(0, 0, -30) * Box(560, 150, 30, align=FLAT)
    return plate - disc(40.2, -24.1, 0) - Pos(SHAFT_X, 0, 0) * disc(22.1, -6, 0)


COMPONENTS = (
    Made("coolant-cover", "Coolant cover plate", make_coolant_cover, Pos(0, 0, 0), ALUMINIUM, 120, facet_deg=FINE),
    Made("front-cover", "Front cover plate", make_front_cover, Pos(0, 0, 8), ALUMINIUM, 120, facet_deg=FINE),
    Made("rotor", "Rotor", make_rotor, Pos(0, 0, 74) * Rot(180, 0, 0), STEEL, 150,
         (Marked("balanced collar with keyway", (-26, -26, -0.1), (26, 26, 8.1)),)),
    Made("carrier", "Carrier", make_carrier, Pos(0, 0, 74), STEEL, 120),
    Made("inner-sleeve", "Inner sleeve", make_inner_sleeve, Pos(SHAFT_X, 0, -6), STEEL, 120,
         (Marked("ground journal", (-6, -6, 16.1), (6, 6, 40.1)),)),
    Made("shaft", "Shaft", make_shaft, Pos(SHAFT_X, 0, 10) * Rot(0, -90, 0), STEEL, 120,
         (Marked("screw thread", (44.1, -6, -6), (64.1, 6, 6)),)),
    Made("gear-block", "Gear block", make_gear_block, Pos(GEAR_X, 58, 0), STEEL, 100,
         (Marked("gear teeth", (-12, -12, 14.1), (12, 12, 21.1)),)),
    Made("sleeve", "Sleeve", make_sleeve, Pos(SHAFT_X, 0, 10), STEEL, 120),
    Made("boss-block", "Block with boss", make_boss_block, Pos(GEAR_X, 0, 0) * Rot(0, 0, 90), ALUMINIUM, 100),
    Made("gear", "Gear", make_gear, Pos(GEAR_X, 0, 12), STEEL, 100,
         (Marked("gear teeth", (-27, -27, 8.1), (27, 27, 27.1)),)),
    Made("key", "Key", make_key, Pos(KEY_X, 0, 71) * Rot(90, 0, 0) * Pos(0, 4.5, -2.2), STEEL, 120),
    Made("nut", "Nut", make_nut, Pos(SHAFT_X, 0, 54) * Rot(0, 0, 15), STEEL, 100),
    Made("flanged-sleeve", "Flanged sleeve", make_flanged_sleeve, Pos(SHAFT_X, 0, 59), STEEL, 100),
)  # fmt: skip


def matrix(location: Location) -> list[list[float]]:
    """A location as the 4×4 pose of INTERFACE.md, without the noise of rotations by right angles."""
    transform = location.wrapped.Transformation()
    rows = [[round(transform.Value(i, j), 12) + 0.0 for j in range(1, 5)] for i in range(1, 4)]
    return [*rows, [0.0, 0.0, 0.0, 1.0]]


def component_entry(number: int, made: Made) -> dict[str, object]:
    """The component's entry in product.json."""
    return {
        "id": made.id,
        "part_number": f"CP-{1300 + number}",
        "revision": "A",
        "name": made.name,
        "file": f"{made.id}.stl",
        "units": "mm",
        "pose": matrix(made.place),
        "density": made.density,
        "friction": 0.2,
        "no_grasp": [{"reason": mark.reason, "box": {"min": mark.low, "max": mark.high}} for mark in made.no_grasp],
    }


def operation_entry(number: int, made: Made) -> dict[str, object]:
    """The operation that lowers the component onto everything placed before it."""
    return {
        "id": f"op-{number:02d}",
        "active": [made.id],
        "passive": [earlier.id for earlier in COMPONENTS[: number - 1]],
        "pose_before": matrix(Pos(0, 0, made.lift)),
        "pose_after": matrix(Pos(0, 0, 0)),
        "waypoints": [],
        "force": 20,
        "fit": "clearance",
    }


def product() -> dict[str, object]:
    """product.json of the sample."""
    return {
        "part_number": "CP-1300",
        "revision": "A",
        "name": "Coolant pump",
        "components": [component_entry(number, made) for number, made in enumerate(COMPONENTS, 1)],
        "environment": [{"id": "pallet", "file": "pallet.stl", "units": "mm", "pose": matrix(Pos(0, 0, 0))}],
        "operations": [operation_entry(number, made) for number, made in enumerate(COMPONENTS, 1)],
    }


def write_cad(name: str, part: Part, facet_deg: float) -> None:
    """The STL of a part and, exact, its STEP."""
    export_stl(part, OUTPUT / f"{name}.stl", tolerance=0.05, angular_tolerance=math.radians(facet_deg))
    export_step(part, OUTPUT / f"{name}.step", timestamp="2026-01-01T00:00:00")


def main() -> None:
    """Write the whole package."""
    OUTPUT.mkdir(exist_ok=True)
    for made in COMPONENTS:
        write_cad(made.id, made.make(), made.facet_deg)
    write_cad("pallet", make_pallet(), MEDIUM)
    (OUTPUT / "product.json").write_text(json.dumps(product(), indent=1) + "\n")


if __name__ == "__main__":
    main()
