"""A straight finger: a stem with a flat gripping surface, or a round one for bores, on a base that is bolted to the jaw."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import CENTRIC_3, CENTRIC_4, INTERNAL, PARALLEL_2
from gripwright.domain.gripper import FINGER_TOO_HEAVY, FingerDesign, FingerSpec
from gripwright.domain.shape import FloatArray
from gripwright.domain.taper import Taper
from gripwright.domain.v_tip import Vee, VTip
from gripwright.plugin_api import Params, RunContext
from gripwright_builtin.fingers.bonding import bonded_finger
from gripwright_builtin.fingers.materials import BY_KEY, Material
from gripwright_builtin.fingers.outline import clip, convex_hull, inset_mm, rectangle, sector, width_mm
from gripwright_builtin.fingers.screws import BY_THREAD, ScrewHole
from gripwright_builtin.fingers.stem import FlatStem, GroovedStem, SliceStem, Stem, step_rad, x_range
from gripwright_builtin.fingers.stiffness import Bending, bend
from gripwright_builtin.fingers.tipped import TaperedStem, VStem, tip_height_mm, tip_properties

if TYPE_CHECKING:  # the CAD kernel takes most of a second, and most designs that are repeated make no finger
    from gripwright.geometry import brep

_TOLERANCE_MM = 1e-6


class StraightFingerParams(Params):
    """Measures and material of a straight finger."""

    thickness: float = Field(8.0, gt=0, le=50, description="mm, of the stem, along the grip direction, pad included")
    width: float = Field(10.0, gt=0, le=50, description="mm, of the stem, across the grip direction")
    nose_radius: float = Field(4.0, gt=0, le=50, description="mm, of the round gripping surface of a centric gripper for bores")
    nose_thickness: float = Field(3.6, gt=0, le=50, description="mm, of a stem for bores, towards the gripper's axis")
    root_width: float = Field(16.0, gt=0, le=60, description="mm, of the base where the stem stands on it")
    base_thickness: float = Field(10.0, ge=4, le=40, description="mm, least thickness of the base")
    base_thickness_max: float = Field(20.0, ge=4, le=60, description="mm, a stiff arm may be as thick")
    wall_min: float = Field(1.2, gt=0, le=10, description="mm, least wall anywhere")
    base_gap: float = Field(0.1, ge=0, le=5, description="mm, from a base to the plane between two fingers, closed")
    chamfer: float = Field(1.0, ge=0, le=3, description="mm, on the stem's outer edges; the gripping surface stays whole")
    material: Literal["auto", "pa12", "aluminium", "steel"] = Field(
        "auto", description="auto: the first of PA12, aluminium, steel that is stiff and strong enough"
    )
    deflection_max: float = Field(0.5, gt=0, le=10, description="mm, of the tip under the grip force")
    strength_safety: float = Field(2.0, ge=1, le=10, description="yield strength over the largest bending stress, at least")

    @model_validator(mode="after")
    def _within_the_slice(self) -> "StraightFingerParams":
        if self.nose_thickness >= self.nose_radius:
            raise ValueError(f"nose_thickness {self.nose_thickness:g} is not less than nose_radius {self.nose_radius:g}")
        return self


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Plan:
    """The finger seen along z: outline of the base, stem and holes."""

    outline_mm: FloatArray  # (k, 2) convex, counter-clockwise
    stem: Stem
    holes_mm: FloatArray  # (2, 2)
    screw: ScrewHole
    trimmed: bool  # the envelope's cylinder cuts the outline
    wall_mm: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Build:
    """What the finger is made of, and how stiff that is."""

    material: Material
    base_thickness_mm: float
    bending: Bending


class StraightFinger:
    """Tip, stem and base in one piece with a pad on the gripping surface, the same for every finger of the gripper.

    The stem lies within the hand model's finger, so what was found free of collision stays so: a box (less its outer
    chamfers), or for bores a slice of a cylinder, whose round side is the gripping surface.
    The base carries the jaw's bolt holes, its outline is the convex hull of jaw and stem, mitred so that no two bases meet
    when the gripper is closed, trimmed to the palm envelope when it is open, and as thick as the arm's moment asks for.
    """

    key: ClassVar[str] = "straight"
    params_model: ClassVar[type[StraightFingerParams]] = StraightFingerParams
    gripper_types: ClassVar[frozenset[str]] = frozenset({PARALLEL_2, CENTRIC_3, CENTRIC_4})

    def __init__(self, params: StraightFingerParams) -> None:
        self._params = params

    def tapers(self, taper_rad: float) -> bool:
        """All of them."""
        return True

    def has_v(self, vee: Vee, taper_rad: float) -> bool:
        """All of them: the tip is as wide as its V."""
        return True

    def design(self, spec: FingerSpec, ctx: RunContext) -> FingerDesign | Rejection:
        """The finger as one exact solid with its mesh, or why it cannot be made."""

        plan = self._plan(spec)
        if isinstance(plan, Rejection):
            return plan
        build = self._build(spec, plan)
        if isinstance(build, Rejection):
            return build
        finger = bonded_finger(
            self._shape(spec, plan, build.base_thickness_mm),
            plan.stem.pad(spec.finger_length_mm),
            build.material,
            spec.pad,
            step_rad(plan.stem),
            self._properties(spec, plan, build),
        )
        limit = spec.actuator.finger_mass_max_kg
        if limit is not None and finger.mass_kg > limit:
            return Rejection(
                FINGER_TOO_HEAVY, f"a finger of {build.material.name} has {finger.mass_kg:.3f} kg, at most {limit:.3f}"
            )
        return finger

    def _plan(self, spec: FingerSpec) -> _Plan | Rejection:
        """Outline and holes, or what does not fit."""
        p, jaw = self._params, spec.jaw
        if jaw.bolt_thread_mm not in BY_THREAD:
            return Rejection("unknown-screw", f"no hole is known for M{jaw.bolt_thread_mm:g}, only for {sorted(BY_THREAD)}")
        screw = BY_THREAD[jaw.bolt_thread_mm]
        stem = self._stem(spec)
        if (short := tip_height_mm(stem) - spec.finger_length_mm) > _TOLERANCE_MM:
            return Rejection("finger-too-short", f"a finger is {short:.2f} mm shorter than its tip")
        if stem.wall_mm < p.wall_min - _TOLERANCE_MM:
            return Rejection(
                "wall-too-thin",
                f"a pad of {spec.pad.thickness_mm:g} mm leaves {stem.wall_mm:.2f} mm of the stem, at least {p.wall_min:.2f}",
            )
        closed = sector(spec.fingers, spec.opening_min_mm, 0.0)
        room = min(float(side.depth_mm(stem.outline_mm).min()) for side in closed)
        if room < -_TOLERANCE_MM:
            return Rejection(
                "fingers-meet", f"at the opening {spec.opening_min_mm:.2f} mm neighbouring stems overlap by {-2.0 * room:.2f} mm"
            )
        jaw_x, y = -spec.jaw_offset_mm, jaw.bolt_pitch_mm / 2.0
        rim = screw.head_bore_mm / 2.0 + p.wall_min
        pad = rectangle(jaw_x, jaw_x + max(jaw.depth_mm, jaw.bolt_setback_mm + rim), max(jaw.width_mm, 2.0 * (y + rim)))
        root = rectangle(*x_range(stem), max(p.root_width, float(np.ptp(stem.outline_mm[:, 1]))))
        outline = convex_hull(np.concatenate([pad, root]))
        for side in sector(spec.fingers, spec.opening_min_mm, min(p.base_gap, max(room, 0.0))):
            outline = clip(outline, side)
        holes = np.array([[jaw_x + jaw.bolt_setback_mm, -y], [jaw_x + jaw.bolt_setback_mm, y]])
        return self._walled(spec, outline, stem, holes, screw)

    def _walled(
        self, spec: FingerSpec, outline: FloatArray, stem: Stem, holes: FloatArray, screw: ScrewHole
    ) -> _Plan | Rejection:
        """The plan, if every hole keeps its wall and the stem stands within the envelope."""
        p = self._params
        axis = np.array([-spec.opening_max_mm / 2.0, 0.0])
        bore = screw.head_bore_mm / 2.0
        outside = float(np.linalg.norm(stem.outline_mm - axis, axis=1).max()) - spec.envelope_mm
        to_envelope = spec.envelope_mm - float(np.linalg.norm(holes - axis, axis=1).max()) - bore
        excess = max(outside, p.wall_min - to_envelope)
        if excess > _TOLERANCE_MM:
            return Rejection(
                "base-outside-envelope",
                f"at the opening {spec.opening_max_mm:.2f} mm the finger's base needs {spec.envelope_mm + excess:.2f} mm "
                f"about the gripper's axis, {excess:.2f} mm more than the palm envelope of {spec.envelope_mm:.2f} mm",
            )
        wall = float(min(to_envelope, inset_mm(outline, holes) - bore if len(outline) else -np.inf))
        if wall < p.wall_min - _TOLERANCE_MM:
            return Rejection(
                "no-room-for-bolts",
                f"at the opening {spec.opening_min_mm:.2f} mm the bolt heads leave {wall:.2f} mm of wall between two bases, "
                f"at least {p.wall_min:.2f}",
            )
        (stem_back, stem_front), width = x_range(stem), float(np.ptp(stem.outline_mm[:, 1]))
        beside = float(holes[1, 1]) - bore - width / 2.0
        if beside < 0.0 and stem_back - bore < holes[0, 0] < stem_front + bore:
            return Rejection("bolt-under-stem", f"the stem covers the bolt heads by {-beside:.2f} mm")
        reach = float(np.linalg.norm(outline - axis, axis=1).max())
        return _Plan(
            outline_mm=outline,
            stem=stem,
            holes_mm=holes,
            screw=screw,
            trimmed=reach > spec.envelope_mm - _TOLERANCE_MM,
            wall_mm=min(wall, stem.wall_mm, width),
        )

    def _build(self, spec: FingerSpec, plan: _Plan) -> _Build | Rejection:
        """The first material that is stiff and strong enough, with the thinnest base that makes it so."""
        p = self._params
        seat = max(plan.screw.head_depth_mm, spec.jaw.pin_length_mm) + max(p.wall_min, 3.0)
        least = max(p.base_thickness, seat)
        stiffest: _Build | None = None
        for material in BY_KEY[p.material]:
            for thickness in np.arange(least, max(p.base_thickness_max, least) + 0.5, 1.0):
                build = _Build(
                    material=material,
                    base_thickness_mm=float(thickness),
                    bending=self._bending(spec, plan, material, float(thickness)),
                )
                if (
                    build.bending.deflection_mm <= p.deflection_max
                    and build.bending.stress_MPa * p.strength_safety <= material.strength_MPa
                ):
                    return build
                stiffest = build
        assert stiffest is not None
        return Rejection(
            "finger-too-weak",
            f"{spec.grip_force_N / spec.fingers:.0f} N would stress a finger of {stiffest.material.name} with "
            f"{stiffest.bending.stress_MPa:.0f} MPa (at most {stiffest.material.strength_MPa / p.strength_safety:.0f} MPa) and "
            f"bend it by {stiffest.bending.deflection_mm:.2f} mm (at most {p.deflection_max:.2f} mm)",
        )

    def _bending(self, spec: FingerSpec, plan: _Plan, material: Material, thickness_mm: float) -> Bending:
        bolts, stem = float(plan.holes_mm[0, 0]), sum(x_range(plan.stem)) / 2.0
        stations = np.linspace(min(bolts, stem), max(bolts, stem), 33)
        return bend(
            spec.grip_force_N / spec.fingers,
            material.modulus_MPa,
            spec.finger_length_mm,
            plan.stem.section,
            stations,
            width_mm(plan.outline_mm, stations),
            thickness_mm,
        )

    def _shape(self, spec: FingerSpec, plan: _Plan, thickness_mm: float) -> "brep.Shape":
        """The exact solid in the finger frame."""
        from gripwright.geometry import brep

        front = -spec.finger_length_mm
        back = front - thickness_mm
        base = brep.prism_z(plan.outline_mm, back, front)
        if plan.trimmed:
            base = brep.common(base, brep.cylinder_z(-spec.opening_max_mm / 2.0, 0.0, spec.envelope_mm, back - 1.0, front + 1.0))
        screw = plan.screw
        tools = []
        for x, y in plan.holes_mm:
            tools.append(brep.cylinder_z(x, y, screw.through_mm / 2.0, back - 1.0, front + 1.0))
            tools.append(brep.cylinder_z(x, y, screw.head_bore_mm / 2.0, front - screw.head_depth_mm, front + 1.0))
        if spec.jaw.pin_diameter_mm > 0:
            pin_top = back + spec.jaw.pin_length_mm + 0.5
            tools.append(brep.cylinder_z(plan.holes_mm[0, 0], 0.0, spec.jaw.pin_diameter_mm / 2.0, back - 1.0, pin_top))
        return brep.single_solid(brep.fuse(brep.cut(base, tools), plan.stem.solid(spec.finger_length_mm)))

    def _stem(self, spec: FingerSpec) -> Stem:
        """Round for a bore, which centric fingers hold; flat for everything else."""
        p = self._params
        if spec.grip == INTERNAL and spec.gripper_type != PARALLEL_2:
            return SliceStem(slices=spec.fingers, nose_radius_mm=p.nose_radius, thickness_mm=p.nose_thickness)
        v = VTip(vee=spec.vee, taper_rad=spec.taper_rad) if spec.vee is not None else None
        groove, taper = spec.groove, Taper(angle_rad=spec.taper_rad) if spec.taper_rad else None
        shape = v or groove or taper
        flat = FlatStem(
            thickness_mm=p.thickness + (0.0 if shape is None else shape.depth_mm),
            width_mm=p.width if v is None else v.vee.width_mm,
            chamfer_mm=p.chamfer,
            inside=spec.grip == INTERNAL,
            pad_mm=spec.pad.thickness_mm,
        )
        if v is not None:
            return VStem(flat=flat, tip=v)
        if taper is not None:
            return TaperedStem(flat=flat, taper=taper)
        return flat if groove is None else GroovedStem(flat=flat, groove=groove)

    def _properties(self, spec: FingerSpec, plan: _Plan, build: _Build) -> dict[str, float]:
        """Figures for the bill of materials and the drawing, mm, N and MPa."""
        p = self._params
        thickness, width = np.ptp(plan.stem.outline_mm, axis=0).tolist()
        tip = (
            {"nose_radius_mm": p.nose_radius} if isinstance(plan.stem, SliceStem) else {"pad_thickness_mm": spec.pad.thickness_mm}
        )
        if spec.groove is not None:
            tip |= {"groove_radius_mm": spec.groove.radius_mm, "contact_offset_mm": spec.groove.depth_mm}
        return (
            tip
            | tip_properties(plan.stem)
            | {
                "deflection_mm": build.bending.deflection_mm,
                "deflection_max_mm": p.deflection_max,
                "stress_MPa": build.bending.stress_MPa,
                "strength_MPa": build.material.strength_MPa,
                "finger_force_N": spec.grip_force_N / spec.fingers,
                "wall_min_mm": plan.wall_mm,
                "finger_length_mm": spec.finger_length_mm,
                "stem_thickness_mm": thickness,
                "stem_width_mm": width,
                "base_thickness_mm": build.base_thickness_mm,
                "bolt_thread_mm": spec.jaw.bolt_thread_mm,
                "bolt_hole_mm": plan.screw.through_mm,
                "bolt_x_mm": float(plan.holes_mm[0, 0]),
                "bolt_pitch_mm": spec.jaw.bolt_pitch_mm,
                "pin_hole_mm": spec.jaw.pin_diameter_mm,
            }
        )
