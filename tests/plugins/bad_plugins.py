"""Plug-ins that each break one rule of the contract, and what must be said about it."""

import random
import time
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np

from gripwright.domain.errors import Cancelled, Rejection
from gripwright.domain.grasp import CENTRIC_3, PARALLEL_2
from gripwright.domain.gripper_set import GripperSet
from gripwright.domain.preference import Preference
from gripwright.domain.shape import Box, Segment
from gripwright.geometry.drawn import primitive_mesh
from gripwright.geometry.frames import rotation_z
from gripwright.plugin_api import Params
from gripwright.testing.primitives import centric_requirement
from gripwright_builtin.fingers.concave import ConcaveFinger
from gripwright_builtin.fingers.straight import StraightFinger
from gripwright_builtin.hands.centric import CentricHand
from gripwright_builtin.optimizers.set_cover import SetCoverOptimizer
from gripwright_builtin.planners.axial import AxialPlanner
from gripwright_builtin.policies.makers import PreferMakers
from gripwright_builtin.rules.box import TwoFingerBox
from gripwright_builtin.rules.cylinder import ThreeFingerCylinder
from gripwright_vacuum.vacuum.hand import VacuumHand
from gripwright_vacuum.vacuum.holding import VacuumHolding


def moved_along(grasp, by_mm):
    X_CG = grasp.X_CG.copy()
    X_CG[:3, 3] += by_mm * X_CG[:3, 2]
    return replace(grasp, X_CG=X_CG)


EXPECTED: dict[type, str] = {}
"""Plug-in → part of the message that must name its fault."""


def breaks(message: str):
    def announced(plugin: type) -> type:
        EXPECTED[plugin] = message
        return plugin

    return announced


class Basic:
    key: ClassVar[str] = "bad"
    params_model: ClassVar[type[Params]] = Params

    def __init__(self, params: Params) -> None:
        self._params = params


class Fitter(Basic):
    """A fitter without a fault: the box along the axes around the segment."""

    def fit(self, component, segment, ctx):
        points = component.mesh.triangles_mm[segment.faces].reshape(-1, 3)
        X = np.eye(4)
        X[:3, 3] = (points.min(axis=0) + points.max(axis=0)) / 2.0
        return Box(X_CB=X, extents_mm=np.ptp(points, axis=0), filled=np.ones(6), filled_min=0.5, rms_mm=0.0)


class Segmenter(Basic):
    """A segmenter without a fault: all faces are one segment."""

    def segment(self, component, ctx):
        return [self._of(component, np.arange(len(component.mesh.faces)))]

    def _of(self, component, faces):
        a, b, c = np.moveaxis(component.mesh.triangles_mm[faces], 1, 0)
        area = float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2.0)
        return Segment(id=0, faces=faces, area_mm2=area, hull_volume_mm3=1.0)


@breaks("fit must take (self, component, segment, ctx), takes (self, mesh, ctx)")
class WrongSignature(Basic):
    def fit(self, mesh, ctx):
        return Rejection("no", "never")


@breaks("cannot be built with its default parameters")
class ParameterWithoutDefault(Fitter):
    class Settings(Params):
        tolerance: float

    params_model = Settings


@breaks("can be changed, the model must be frozen")
class ChangeableParameters(Fitter):
    class Settings(Params, frozen=False):
        tolerance: float = 1.0

    params_model = Settings


@breaks("__init__ works for")
class WorkInInit(Fitter):
    def __init__(self, params):
        time.sleep(0.05)


@breaks("an instance cannot be pickled")
class NotPicklable(Fitter):
    def __init__(self, params):
        self._measure = lambda x: x


@breaks("fit changes its argument ['component'].mesh.vertices_mm")
class MovesTheMesh(Fitter):
    def fit(self, component, segment, ctx):
        component.mesh.vertices_mm[:] *= 1.001
        return super().fit(component, segment, ctx)


@breaks("none of 18 segments is answered with a primitive, so json, unit, picture and scale have nothing to look at")
class NeverFits(Fitter):
    def fit(self, component, segment, ctx):
        return Rejection("no-box", f"the surface of {segment.area_mm2:.0f} mm² is no box")


class NoCones(Fitter):
    """Refuses its author's sample of a cone, and answers others."""

    def fit(self, component, segment, ctx):
        if "cone" in component.id:
            return Rejection("no-box", "a cone is no box")
        return super().fit(component, segment, ctx)


@breaks("two runs of the same input and seed differ at extents_mm")
class NotDeterministic(Fitter):
    def fit(self, component, segment, ctx):
        box = super().fit(component, segment, ctx)
        return replace(box, extents_mm=box.extents_mm * (1.0 + 1e-3 * random.random()))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BoxDrawnTwiceAsHigh(Box):
    def drawn(self):
        mesh = primitive_mesh(Box(X_CB=self.X_CB, extents_mm=self.extents_mm, filled=self.filled, filled_min=0.5, rms_mm=0.0))
        return replace(mesh, vertices_mm=mesh.vertices_mm * [1.0, 1.0, 2.0])


@breaks("at most 2 % apart")
class DrawsAnotherSolid(Fitter):
    def fit(self, component, segment, ctx):
        box = super().fit(component, segment, ctx)
        return BoxDrawnTwiceAsHigh(
            X_CB=box.X_CB, extents_mm=box.extents_mm, filled=box.filled, filled_min=box.filled_min, rms_mm=box.rms_mm
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SlottedBox(Box):
    """A primitive of its own."""


def slotted(box):
    return SlottedBox(X_CB=box.X_CB, extents_mm=box.extents_mm, filled=box.filled, filled_min=box.filled_min, rms_mm=box.rms_mm)


@breaks('fit returned SlottedBox, which its PluginEntry.primitives does not name: add "bad_plugins:SlottedBox" to it')
class FitsWhatNoManifestNames(Fitter):
    def fit(self, component, segment, ctx):
        return slotted(super().fit(component, segment, ctx))


@breaks("takes longer than")
class NeverReturns(Fitter):
    def fit(self, component, segment, ctx):
        while True:
            try:
                time.sleep(0.01)
            except Exception:  # noqa: BLE001 - what a plug-in may do
                continue


@breaks("fit raises ZeroDivisionError: division by zero")
class Raises(Fitter):
    def fit(self, component, segment, ctx):
        return 1 / 0


@breaks('fit raises NoBox: too flat; an expected "no" is returned as a Rejection')
class RejectsByException(Fitter):
    def fit(self, component, segment, ctx):
        class NoBox(Exception):
            pass

        raise NoBox("too flat")


@breaks("fit raises SystemExit: 3")
class Leaves(Fitter):
    def fit(self, component, segment, ctx):
        raise SystemExit(3)


@breaks("fit returns None")
class ReturnsNothing(Fitter):
    def fit(self, component, segment, ctx):
        return None


@breaks("a Rejection needs a code and a sentence")
class RejectsWithoutReason(Fitter):
    def fit(self, component, segment, ctx):
        return Rejection("no", "")


@breaks("lengths are mm")
class FitsInMetres(Fitter):
    def fit(self, component, segment, ctx):
        box = super().fit(component, segment, ctx)
        return replace(box, extents_mm=box.extents_mm / 1000.0)


@breaks("at 10 times the size the volume is")
class AddsAMillimetre(Fitter):
    def fit(self, component, segment, ctx):
        box = super().fit(component, segment, ctx)
        return replace(box, extents_mm=box.extents_mm + 1.0)


@dataclass(frozen=True, kw_only=True)
class ArrayBox:
    """A primitive that hands out an array."""

    kind: str = field(default="box", init=False)
    extents_mm: Any
    surface_filled: bool = True
    rms_mm: float = 0.0

    @property
    def volume_mm3(self):
        return float(np.prod(self.extents_mm))

    def to_dict(self):
        return {"extents": self.extents_mm}


@breaks("to_dict is not JSON")
class ArrayInDict(Fitter):
    def fit(self, component, segment, ctx):
        return ArrayBox(extents_mm=super().fit(component, segment, ctx).extents_mm)


@breaks("swallows the cancellation")
class CannotBeStopped(Fitter):
    def fit(self, component, segment, ctx):
        try:
            ctx.progress(0.5, "half way")
        except Cancelled:
            return Rejection("stopped", "the caller asked to stop")
        return super().fit(component, segment, ctx)


KEPT: list[np.ndarray] = []


@breaks("each of 4 calls of fit keeps")
class LeaksMemory(Fitter):
    def fit(self, component, segment, ctx):
        KEPT.append(np.ones(2**19))
        return super().fit(component, segment, ctx)


@breaks("face 0 is in more than one segment")
class FaceTwice(Segmenter):
    def segment(self, component, ctx):
        everything = super().segment(component, ctx)
        return [*everything, replace(self._of(component, np.arange(1)), id=1)]


@breaks("face 0 is in no segment (1 faces are in none)")
class FaceLeftOut(Segmenter):
    def segment(self, component, ctx):
        return [self._of(component, np.arange(1, len(component.mesh.faces)))]


@breaks("every sample is rejected")
class RejectsEverything(Segmenter):
    def segment(self, component, ctx):
        return Rejection("no-segments", "none of 12 samples is good enough")


@breaks("accepts is empty")
class AcceptsNothing(ThreeFingerCylinder):
    accepts = frozenset()


@breaks("accepts cylinder: none of 4 sample primitives of that kind is answered with a requirement")
class NeverAsks(ThreeFingerCylinder):
    def apply(self, fit):
        return Rejection("no-type", f"the {fit.kind} is held by nothing")


@breaks("accepts marble: none of 0 sample primitives of that kind is answered with a requirement")
class NeverAsked(ThreeFingerCylinder):
    accepts = frozenset({"marble"})


@breaks("opening_width_mm is 0.02 for a primitive of at most 28.3 mm")
class OpensInMetres(ThreeFingerCylinder):
    def apply(self, fit):
        found = super().apply(fit)
        return found if isinstance(found, Rejection) else [replace(one, opening_width_mm=0.02) for one in found]


@breaks("apply asks to hold SlottedBox, which its PluginEntry.primitives does not name")
class HoldsWhatNoManifestNames(TwoFingerBox):
    def apply(self, fit):
        found = super().apply(fit)
        return found if isinstance(found, Rejection) else [replace(one, primitive=slotted(one.primitive)) for one in found]


@breaks("finger 1 stands at [12.0, 0.0, 0.0], 6 mm along its own x was expected")
class TakesWidthForRadius(CentricHand):
    def finger_poses(self, opening_width_mm):
        return super().finger_poses(2.0 * opening_width_mm)


@breaks("the finger fills x ≥ 0 from x = 0")
class FingerInTheComponent(CentricHand):
    def finger(self, finger_length_mm, grip):
        return [replace(one, vertices_mm=one.vertices_mm - [4.0, 0.0, 0.0]) for one in super().finger(finger_length_mm, grip)]


@breaks("the palm reaches from")
class PalmInFront(CentricHand):
    def palm(self, finger_length_mm, envelope_mm, depth_mm):
        return super().palm(0.0, envelope_mm, depth_mm)


@breaks("X_CG is not rigid")
class Mirrors(AxialPlanner):
    def plan(self, component, segment, requirement, hand, ctx):
        found = super().plan(component, segment, requirement, hand, ctx)
        return [replace(one, X_CG=one.X_CG @ np.diag([-1.0, 1.0, 1.0, 1.0])) for one in found]


@breaks("its z points along none of the directions")
class GraspsFromTheSide(AxialPlanner):
    def plan(self, component, segment, requirement, hand, ctx):
        found = super().plan(component, segment, requirement, hand, ctx)
        quarter = rotation_z(np.pi / 2.0)[[2, 0, 1, 3]][:, [2, 0, 1, 3]]  # about x
        return [replace(one, X_CG=one.X_CG @ quarter) for one in found]


@breaks("at the end of its leeway: its z points along none of the directions")
class LeavesTheAxis(AxialPlanner):
    def plan(self, component, segment, requirement, hand, ctx):
        found = super().plan(component, segment, requirement, hand, ctx)
        return [replace(one, leeway=np.array([[-0.3, 0.3], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]])) for one in found]


@breaks("its leeway is no finite array (4, 2) of ranges from … to that hold 0")
class StandsForOthers(AxialPlanner):
    def plan(self, component, segment, requirement, hand, ctx):
        found = super().plan(component, segment, requirement, hand, ctx)
        return [replace(one, leeway=np.array([[0.0, 0.0], [0.1, 0.2], [0.0, 0.0], [0.0, 0.0]])) for one in found]


@breaks("the seated face enters the component by 0.0995 mm")
class PressedIn(VacuumHolding):
    def seat(self, grasp, surface, hand, ctx):
        return moved_along(super().seat(grasp, surface, hand, ctx), 0.1)


@breaks("hold asks for 0.00")
class ForceInKilonewtons(VacuumHolding):
    def hold(self, grasp, contacts, load, component, ctx):
        found = super().hold(grasp, contacts, load, component, ctx)
        return replace(found, required_force_N=found.required_force_N / 1000.0)


@breaks("in another frame than the component's?")
class ContactInTheHand(VacuumHolding):
    def contacts(self, grasp, surface, hand, finger_length_mm, ctx):
        return [replace(one, centre_C=np.zeros(3)) for one in super().contacts(grasp, surface, hand, finger_length_mm, ctx)]


@breaks("the face is 20 mm wide, 10 to 11 was expected")
class CupOfOneSize(VacuumHand):
    def sized(self, opening_width_mm):
        return self


@breaks("no gripper holds component-1, which can be held")
class HoldsNothing(Basic):
    def solve(self, problem, ctx):
        return GripperSet(grippers=(), lower_bound=0, proven=False, candidates=0)


@breaks("grippers are fewer than the lower bound of")
class BoundAboveTheSolution(SetCoverOptimizer):
    def solve(self, problem, ctx):
        found = super().solve(problem, ctx)
        return replace(found, lower_bound=found.lower_bound + 1)


class OneTypeOfFinger(StraightFinger):
    """A finger designer without a fault, of one gripper type: the checks make fewer solids."""

    gripper_types = frozenset({PARALLEL_2})


@breaks("brep: bytes are not a binary BRep stream")
class NoSolid(OneTypeOfFinger):
    def design(self, spec, ctx):
        found = super().design(spec, ctx)
        return found if isinstance(found, Rejection) else replace(found, brep=b"solid")


@breaks("the mesh is not closed")
class OpenMesh(OneTypeOfFinger):
    def design(self, spec, ctx):
        found = super().design(spec, ctx)
        return found if isinstance(found, Rejection) else replace(found, mesh=replace(found.mesh, faces=found.mesh.faces[1:]))


@breaks("which is no density of a solid")
class MassInGrams(OneTypeOfFinger):
    def design(self, spec, ctx):
        found = super().design(spec, ctx)
        return found if isinstance(found, Rejection) else replace(found, mass_kg=found.mass_kg * 1000.0)


@breaks("finger and pad do not make up")
class PadWithoutASeat(OneTypeOfFinger):
    def design(self, spec, ctx):
        found = super().design(spec, ctx)
        if isinstance(found, Rejection) or found.bonded is None:
            return found
        whole = replace(found.bonded.bare, brep=found.brep, mesh=found.mesh)
        return replace(found, bonded=replace(found.bonded, bare=whole))


@breaks("of the tip lie in the groove's cylinder")
class NoGroove(ConcaveFinger):
    gripper_types = frozenset({CENTRIC_3})

    def design(self, spec, ctx):
        return super().design(replace(spec, groove=None), ctx)


@breaks("a factor of 0.8 needs a reason")
class PrefersWithoutReason(PreferMakers):
    def actuator(self, actuator):
        return Preference(factor=0.8)


@breaks("grip returns bool, neither a Preference nor a Rejection")
class SaysYes(PreferMakers):
    def grip(self, component, segment, requirement, marks):
        return True


@breaks("actuator raises ValueError: a preference's factor is -1.0, a finite number above 0 is needed")
class WeighsBelowZero(PreferMakers):
    def actuator(self, actuator):
        return Preference(factor=-1.0, detail="not at all")


@breaks("grip changes its argument ['marks']")
class ForgetsMarks(PreferMakers):
    def grip(self, component, segment, requirement, marks):
        marks.clear()
        return super().grip(component, segment, requirement, marks)


@breaks("has the methods of no kind of plug-in")
class NoKind(Basic):
    def work(self):
        return None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Marble:
    """A shape that no built-in sample has, and that does not say what it looks like."""

    radius_mm: float
    rms_mm: float = 0.0
    surface_filled: bool = True
    kind: str = field(default="marble", init=False)

    @property
    def volume_mm3(self):
        return 4.0 / 3.0 * np.pi * self.radius_mm**3

    def to_dict(self):
        return {"radius": self.radius_mm}


class MarbleHolder(Basic):
    """A rule for marbles that takes metres."""

    accepts = frozenset({"marble"})

    def apply(self, fit):
        asked = centric_requirement(np.eye(4))
        return [replace(asked, opening_width_mm=0.002 * fit.radius_mm, primitive=fit, rule=self.key)]


class MarbleRefuser(MarbleHolder):
    """A rule for marbles that holds none."""

    def apply(self, fit):
        return Rejection("no-type", f"a marble of {fit.radius_mm:.0f} mm is held by nothing")
