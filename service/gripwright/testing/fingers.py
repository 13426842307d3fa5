"""Checks of finger designers: one valid solid in frame F, its mesh and mass as stated, its pad, its groove, its taper, its V."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from gripwright.domain.errors import InvalidGeometry, Rejection
from gripwright.domain.grasp import CENTRIC_3, CENTRIC_4, EXTERNAL, PARALLEL_2, SURFACE
from gripwright.domain.gripper import NO_STROKE, Actuator, FingerDesign, FingerSpec
from gripwright.domain.groove import Groove
from gripwright.domain.taper import Taper
from gripwright.domain.v_tip import SIDES, Vee, VTip
from gripwright.geometry import brep
from gripwright.geometry.adjacency import face_adjacency
from gripwright.geometry.frames import inverse, transform
from gripwright.geometry.measures import face_areas_mm2, volume_mm3
from gripwright.plugin_api import grips_of
from gripwright.testing.trial import Case, Check, Trial, is_length

_LENGTH_MM = 30.0
_PLANE_MM = 1e-3
_FACE_MM, _FACE_LENGTH_MM = 32.0, 80.0
_GROOVE = Groove(radius_mm=27.0, width_mm=10.0)
_TAPERS = (12.0, -12.0)
_TAPERED_SHARE = 0.95  # of the width of the tip; edges may be broken
_VEE = Vee(angle_rad=float(np.radians(120.0)), depth_mm=3.0)
_V_TAPERS = (0.0, *_TAPERS)
_DENSITIES_KG_M3 = (500.0, 20_000.0)


def cases(trial: Trial) -> list[Case]:
    """Each grip that it serves of each gripper type; besides, a groove of a tip shaper, tapered and V tips of who makes them."""
    specs = {
        f"{gripper_type}, {grip}": _face_spec(gripper_type) if grip == SURFACE else _spec(gripper_type, grip)
        for gripper_type in sorted(trial.plugin.gripper_types)
        for grip in sorted(grips_of(trial.plugin))
    }
    if hasattr(trial.plugin, "groove") and CENTRIC_3 in trial.plugin.gripper_types:
        specs[f"{CENTRIC_3}, grooved"] = replace(_spec(CENTRIC_3, EXTERNAL), groove=_GROOVE)
    if hasattr(trial.plugin, "tapers"):
        for gripper_type in sorted(trial.plugin.gripper_types):
            for degrees in _TAPERS:
                spec = replace(_spec(gripper_type, EXTERNAL), taper_rad=float(np.radians(degrees)))
                specs[f"{gripper_type}, tapered {degrees:g}°"] = spec
    if hasattr(trial.plugin, "has_v") and PARALLEL_2 in trial.plugin.gripper_types:
        for taper in map(float, np.radians(_V_TAPERS)):
            specs[f"{PARALLEL_2}, V tips, tapered {np.degrees(taper):g}°"] = _v_spec(taper)
    return [Case(name=name, method="design", arguments={"spec": spec}) for name, spec in specs.items()]


def _face_spec(gripper_type: str) -> FingerSpec:
    """A face of 32 mm on a long stem."""
    return replace(
        _spec(gripper_type, SURFACE),
        finger_length_mm=_FACE_LENGTH_MM,
        jaw_offset_mm=0.0,
        opening_min_mm=_FACE_MM,
        opening_max_mm=_FACE_MM,
        stroke_mm=0.0,
        fingers=1,
        actuator=Actuator(
            maker="Sample", model="S2", gripper_type=gripper_type, stroke_mm=0.0, stroke_basis=NO_STROKE, opening_max_mm=50.0
        ),
        contact_radii_mm=(float("inf"),),
    )


def _spec(gripper_type: str, grip: str) -> FingerSpec:
    """An opening of 52 to 60 mm, jaws that stand 10 mm nearer to the axis than the gripping surface."""
    return FingerSpec(
        gripper_type=gripper_type,
        grip=grip,
        finger_length_mm=_LENGTH_MM,
        jaw_offset_mm=10.0,
        opening_min_mm=52.0,
        opening_max_mm=60.0,
        stroke_mm=8.0,
        fingers={PARALLEL_2: 2, CENTRIC_4: 4}.get(gripper_type, 3),
        envelope_mm=60.0,
        actuator=Actuator(maker="Sample", model="S1", gripper_type=gripper_type, stroke_mm=8.0),
        contact_radii_mm=(27.0, float("inf")),
        grip_force_N=60.0,
    )


def _v_spec(taper_rad: float) -> FingerSpec:
    return replace(_spec(PARALLEL_2, EXTERNAL), vee=_VEE, taper_rad=taper_rad)


def designs(trial: Trial) -> Iterable[str]:
    """A FingerDesign, or a Rejection that says why not."""
    for run in trial.runs:
        if isinstance(run.answer, Rejection):
            if not (run.answer.code and run.answer.detail):
                yield f"{run.case.name}: a Rejection needs a code and a sentence"
        elif not isinstance(run.answer, FingerDesign):
            yield f"{run.case.name}: design returns {type(run.answer).__name__}, neither a FingerDesign nor a Rejection"


def solid(trial: Trial) -> Iterable[str]:
    """The BRep is one valid solid, the mesh closed, and both have the volume that is stated."""
    for case, design in trial.answers():
        try:
            exact = brep.measure(brep.single_solid(brep.read_brep(design.brep))).volume_mm3
        except InvalidGeometry as error:
            yield f"{case.name}: brep: {error.detail}"
            continue
        adjacency = face_adjacency(design.mesh)
        if adjacency.open_edges or adjacency.non_manifold_edges:
            yield f"{case.name}: the mesh is not closed: {adjacency.open_edges} open edges"
        for name, volume in (("volume_mm3", design.volume_mm3), ("the mesh's volume", volume_mm3(design.mesh))):
            if not np.isclose(volume, exact, rtol=0.01):
                yield f"{case.name}: {name} is {volume:.6g} mm³, the solid has {exact:.6g} mm³"
        low, high = _DENSITIES_KG_M3
        if not is_length(design.mass_kg) or not low <= design.mass_kg / (exact * 1e-9) <= high:
            yield f"{case.name}: mass_kg is {design.mass_kg} for {exact:.6g} mm³, which is no density of a solid"


def frame(trial: Trial) -> Iterable[str]:
    """The tip ends at z = 0, and before the jaws all lies behind the gripping surface x = 0; a face lies in z = 0."""
    for case, design in trial.answers():
        points, sign = design.mesh.vertices_mm, 1.0 if case.arguments["spec"].grip == EXTERNAL else -1.0
        if abs(points[:, 2].max()) > _PLANE_MM:
            yield f"{case.name}: the tip ends at z = {points[:, 2].max():.6g} mm, 0 was expected"
        if case.arguments["spec"].grip == SURFACE:
            wide = 2.0 * float(np.hypot(*points[points[:, 2] > -_PLANE_MM][:, :2].T).max())
            if not 0.5 * _FACE_MM <= wide <= 1.1 * _FACE_MM:
                yield f"{case.name}: the face at z = 0 is {wide:.6g} mm wide, {_FACE_MM:g} mm were asked for"
            continue
        stem = points[points[:, 2] > -_LENGTH_MM + _PLANE_MM]
        if len(stem) and abs((sign * stem[:, 0]).min()) > _PLANE_MM:
            yield f"{case.name}: the gripping surface lies at x = {sign * (sign * stem[:, 0]).min():.6g} mm, 0 was expected"


def parts(trial: Trial) -> Iterable[str]:
    """A bare finger and its pad are valid solids that make up the finger, and the pad reaches the gripping surface."""
    for case, design in trial.answers():
        if design.bonded is None:
            continue
        try:
            made = [brep.single_solid(brep.read_brep(part.brep)) for part in (design.bonded.bare, design.bonded.pad)]
        except InvalidGeometry as error:
            yield f"{case.name}: bonded: {error.detail}"
            continue
        together, pad = brep.measure(brep.fuse(*made)).volume_mm3, brep.measure(made[1]).volume_mm3
        if max(abs(together - design.volume_mm3), abs(together - brep.measure(made[0]).volume_mm3 - pad)) > 0.01 * pad:
            yield f"{case.name}: finger and pad do not make up the {design.volume_mm3:.6g} mm³ of the finger"
        axis = 2 if case.arguments["spec"].grip == SURFACE else 0
        if abs(np.abs(brep.bounds_mm(made[1])[:, axis]).min()) > _PLANE_MM:
            yield f"{case.name}: the pad does not reach the plane {'xyz'[axis]} = 0"
        if not np.isclose(design.mass_kg, design.bonded.bare.mass_kg + design.bonded.pad.mass_kg):
            yield f"{case.name}: mass_kg is not that of finger and pad together"


def groove(trial: Trial) -> Iterable[str]:
    """Nothing of a stem lies within the groove that the spec names, and next to it there is something."""
    for case, design in trial.answers():
        asked = case.arguments["spec"].groove
        if asked is None:
            continue
        solid = brep.read_brep(design.brep)
        within, around = (
            brep.measure(brep.common(solid, brep.cylinder_z(asked.axis_x_mm, 0.0, radius, -_LENGTH_MM, 0.0))).volume_mm3
            for radius in (asked.radius_mm, asked.radius_mm + _PLANE_MM)
        )
        if within > 1e-6 or around <= 1e-6:
            yield f"{case.name}: {within:.4g} mm³ of the tip lie in the groove's cylinder, or the groove is deeper"


def tapers(trial: Trial) -> Iterable[str]:
    """The tip's gripping surface is a plane of the angle that the spec names, as high as a taper, and nothing lies before it."""
    for case, design in trial.answers():
        angle = case.arguments["spec"].taper_rad
        if not angle or case.arguments["spec"].vee is not None:
            continue
        asked = Taper(angle_rad=angle)
        corners = transform(inverse(asked.X_FP), design.mesh.triangles_mm)  # (m, 3, 3)
        low = np.array([-_PLANE_MM, -np.inf, -asked.slant_mm - _PLANE_MM])
        on_plane = ((corners >= low) & (corners <= [_PLANE_MM, np.inf, _PLANE_MM])).all(axis=(1, 2))
        area = float(face_areas_mm2(design.mesh)[on_plane].sum())
        stem = design.mesh.vertices_mm[design.mesh.vertices_mm[:, 2] > -_LENGTH_MM + _PLANE_MM]
        whole = asked.slant_mm * float(np.ptp(stem[:, 1]))
        if area < _TAPERED_SHARE * whole:
            degrees = np.degrees(angle)
            yield f"{case.name}: {area:.4g} mm² of the tip are inclined by {degrees:.1f}° where {whole:.4g} mm² were expected"
        within = (corners[..., 2] >= -asked.slant_mm) & (corners[..., 2] <= 0.0)
        if (corners[..., 0][within] < -_PLANE_MM).any():
            yield f"{case.name}: the tip reaches before its inclined gripping surface"


def has_v(trial: Trial) -> Iterable[str]:
    """Both flanks of the V that the spec names are there, whole and as high as a tip, and nothing lies before them."""
    for case, design in trial.answers():
        spec = case.arguments["spec"]
        if spec.vee is None:
            continue
        tip, triangles = VTip(vee=spec.vee, taper_rad=spec.taper_rad), design.mesh.triangles_mm  # (m, 3, 3)
        on_tip = (triangles[..., 2] >= -tip.height_mm - _PLANE_MM).all(axis=1)
        for side in SIDES:
            off = transform(inverse(tip.X_FP(side)), triangles)[..., 0]
            beside = on_tip & (side * triangles[..., 1] >= -_PLANE_MM).all(axis=1)
            area = float(face_areas_mm2(design.mesh)[beside & (np.abs(off) <= _PLANE_MM).all(axis=1)].sum())
            which = f"the flank at {'+' if side > 0.0 else '−'}y of the V"
            if area < _TAPERED_SHARE * tip.flank_mm2:
                yield f"{case.name}: {which} has {area:.4g} mm² where {tip.flank_mm2:.4g} mm² were expected"
            if (off[beside] < -_PLANE_MM).any():
                yield f"{case.name}: the tip reaches before {which}"


CHECKS = (
    Check("design", "a design, or a no with its reason", designs),
    Check("solid", "one valid solid, a closed mesh, the volume and mass that are stated", solid),
    Check("frame", "tip at z = 0, gripping surface at x = 0", frame),
    Check("parts", "bare finger and pad make up the finger", parts),
    Check("groove", "the tip has the groove that is asked for", groove),
    Check("tapers", "the tip has the taper that is asked for", tapers),
    Check("has_v", "the tip has the V that is asked for", has_v),
)
