"""Checks of holding models: a seat that enters nothing, contacts that face the hand, forces in N that grow with the load."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import SURFACE, Grasp, Hold
from gripwright.domain.gripper import NO_STROKE, Actuator
from gripwright.domain.holding import Contact, Load
from gripwright.domain.shape import FloatArray
from gripwright.geometry.frames import inverse, is_rigid
from gripwright.geometry.held_surface import Surface
from gripwright.testing.sample_hands import SampleFace
from gripwright.testing.samples import TILTED, sample_components
from gripwright.testing.trial import Case, Check, Trial, is_length

_FACE_MM, _LENGTH_MM = 16.0, 40.0
_PLANNED_MM = 0.2  # by so much the planned grasps stand off
_FAR_MM = 0.5  # from the planned grasp
_MASSES_KG = (0.1, 0.4)
_FORCES_N = (0.1, 1e4)  # for one of these masses
_ENTER_MM = 1e-6


def cases(trial: Trial) -> list[Case]:
    """A flat face of a box, upright and tilted; two loads; faces of two sizes on one actuator."""
    found = []
    for gripper_type in sorted(trial.plugin.gripper_types):
        hand = SampleFace(gripper_type, _FACE_MM)
        for prefix, X_CB in (("", np.eye(4)), ("tilted ", TILTED)):
            sample = next(sample for sample in sample_components() if sample.name == f"{prefix}box with boss")
            component = replace(sample.component, texture="machined", ferrous=True)
            surface, grasp = Surface(component.mesh), _grasp(gripper_type, X_CB)
            name = f"{prefix}box with boss, {gripper_type}"
            asked = {"grasp": _moved_back(grasp, _PLANNED_MM), "surface": surface, "hand": hand}
            found.append(Case(name=name, method="seat", arguments=asked))
            touching = {"grasp": _moved_back(grasp, 0.0005), "surface": surface, "hand": hand, "finger_length_mm": _LENGTH_MM}
            found.append(Case(name=name, method="contacts", arguments=touching))
            for mass in _MASSES_KG:
                held = {"grasp": grasp, "contacts": (_contact(grasp),), "load": _load(X_CB, mass), "component": component}
                found.append(Case(name=f"{name}, {mass:g} kg", method="hold", arguments=held))
        for width in (_FACE_MM / 2.0, _FACE_MM):
            arguments = {"actuator": _actuator(gripper_type), "opening_width_mm": width}
            found.append(Case(name=f"{gripper_type}, {width:g} mm", method="grip_force_N", arguments=arguments))
    return found


def _grasp(gripper_type: str, X_CB: FloatArray) -> Grasp:
    """On the middle of the box's lower face, from below."""
    X_BG = np.eye(4)
    X_BG[:3, 3] = 20.0, 15.0, 0.0
    return Grasp(X_CG=X_CB @ X_BG, gripper_type=gripper_type, grip=SURFACE, opening_width_mm=_FACE_MM)


def _moved_back(grasp: Grasp, by_mm: float) -> Grasp:
    X_CG = grasp.X_CG.copy()
    X_CG[:3, 3] -= by_mm * X_CG[:3, 2]
    return replace(grasp, X_CG=X_CG)


def _contact(grasp: Grasp) -> Contact:
    return Contact(
        height_mm=_FACE_MM,
        area_mm2=np.pi / 4.0 * _FACE_MM**2,
        centre_C=grasp.X_CG[:3, 3],
        normal_C=-grasp.X_CG[:3, 2],
        gap_mm=0.0005,
    )


def _load(X_CB: FloatArray, mass_kg: float) -> Load:
    """It hangs on the face, upside down, and is set down: the weight and the motion go along the gripper's z."""
    centre = X_CB[:3, :3] @ np.array([20.0, 15.0, 6.0]) + X_CB[:3, 3]
    down = X_CB[:3, 2]
    return Load(mass_kg=mass_kg, force_N=0.0, centroid_C=centre, gravity_C=down[None], insertion_C=np.stack([centre, down]))


def _actuator(gripper_type: str) -> Actuator:
    return Actuator(
        maker="Sample",
        model="S2",
        gripper_type=gripper_type,
        stroke_mm=0.0,
        stroke_basis=NO_STROKE,
        opening_max_mm=50.0,
        grip_force_N=100.0,
    )


def seats(trial: Trial) -> Iterable[str]:
    """A grasp near the planned one, whose face has the component before it."""
    for case, seated in _of(trial, "seat"):
        planned = case.arguments["grasp"]
        if not isinstance(seated, Grasp) or not is_rigid(seated.X_CG):
            yield f"{case.name}: seat returns {type(seated).__name__}, neither a rigid Grasp nor a Rejection"
            continue
        if (seated.gripper_type, seated.grip, seated.opening_width_mm) != (
            planned.gripper_type,
            planned.grip,
            planned.opening_width_mm,
        ):
            yield f"{case.name}: the seated grasp is of another type, grip or size than the planned one"
        way = float(np.linalg.norm((inverse(planned.X_CG) @ seated.X_CG)[:3, 3]))
        if way > _FAR_MM:
            yield f"{case.name}: the seated grasp lies {way:.4g} mm from the planned one, {_PLANNED_MM:g} mm would do"
        half = 0.35 * _FACE_MM  # within the face, whatever its outline
        low, high = np.array([-half, -half, -_LENGTH_MM]), np.array([half, half, 0.0])
        depth = -float(case.arguments["surface"].within(seated.X_CG, low, high)[..., 2].min(initial=0.0))
        if depth > _ENTER_MM:
            yield f"{case.name}: the seated face enters the component by {depth:.4g} mm"


def touches(trial: Trial) -> Iterable[str]:
    """One contact a face, in the component's frame, that looks at the hand."""
    for case, found in _of(trial, "contacts"):
        if not isinstance(found, Sequence) or not found or not all(isinstance(one, Contact) for one in found):
            yield f"{case.name}: contacts returns {type(found).__name__}, neither a sequence of Contact nor a Rejection"
            continue
        X_CG = case.arguments["grasp"].X_CG
        for number, one in enumerate(found, 1):
            off = float(np.linalg.norm(one.centre_C - X_CG[:3, 3]))
            if off > _FACE_MM:
                yield f"{case.name}: contact {number} lies {off:.4g} mm from the face, in another frame than the component's?"
            if not np.allclose(one.normal_C, -X_CG[:3, 2], atol=0.1):
                yield f"{case.name}: the normal of contact {number} does not point from the component to the hand"
            if not 0.0 < one.area_mm2 <= 1.3 * _FACE_MM**2:
                yield f"{case.name}: contact {number} has {one.area_mm2:.4g} mm², a face of {_FACE_MM:g} mm has less"


def holds(trial: Trial) -> Iterable[str]:
    """A force in N, which a heavier component asks more of."""
    forces: dict[str, list[float]] = {}
    for case, held in _of(trial, "hold"):
        low, high = _FORCES_N
        if not isinstance(held, Hold) or not low <= held.required_force_N <= high:
            told = f"{held.required_force_N:.4g} N" if isinstance(held, Hold) else type(held).__name__
            yield f"{case.name}: hold asks for {told}, {low:g} to {high:g} N was expected"
            continue
        forces.setdefault(case.name.rpartition(",")[0], []).append(held.required_force_N)
    for name, found in forces.items():
        if len(found) == len(_MASSES_KG) and found[0] >= found[1]:
            yield f"{name}: {_MASSES_KG[1]:g} kg ask for {found[1]:.4g} N, {_MASSES_KG[0]:g} kg for {found[0]:.4g} N"


def grip_forces(trial: Trial) -> Iterable[str]:
    """A positive force, or None; a larger face of the same actuator is no weaker."""
    found: dict[str, list[float]] = {}
    for case, force in _of(trial, "grip_force_N"):
        if not is_length(force):
            yield f"{case.name}: grip_force_N is {force}"
            continue
        found.setdefault(case.name.rpartition(",")[0], []).append(force)
    for name, forces in found.items():
        if forces != sorted(forces):
            yield f"{name}: a larger face holds with less, {forces[-1]:.4g} N against {forces[0]:.4g} N"


def answered(trial: Trial) -> Iterable[str]:
    """The samples are flat, machined steel: what holds by a face holds them."""
    for method in ("seat", "contacts", "hold"):
        said = [run.answer.detail for run in trial.runs if run.case.method == method and isinstance(run.answer, Rejection)]
        if said and not list(_of(trial, method)):
            yield f"{method} rejects every sample: {said[0]}"


def _of(trial: Trial, method: str) -> Iterable[tuple[Case, Any]]:
    return ((case, answer) for case, answer in trial.answers() if case.method == method)


CHECKS = (
    Check("seat", "a seated grasp is near the planned one and enters nothing", seats),
    Check("contacts", "contacts lie on the component and look at the hand", touches),
    Check("hold", "a required force in N that grows with the load", holds),
    Check("grip force", "an actuator's force is positive, or not known", grip_forces),
    Check("holds something", "a flat, machined face of steel is held", answered),
)
