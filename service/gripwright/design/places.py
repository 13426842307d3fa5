"""The grasps between planned ones: every planned grasp stands for some, which are divided ever more finely."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gripwright.design.core_hand import core_hand
from gripwright.design.hand_check import HandCheck, OperationScene
from gripwright.domain.grasp import EXTERNAL, SURFACE, Grasp
from gripwright.domain.shape import BoolArray, FloatArray, IntArray
from gripwright.geometry.frames import moved
from gripwright.plugin_api import HandModel


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Places:
    """n ranges of grasps about `parents`: turned about the gripper's x and z (rad), shifted along its y and z (mm)."""

    parents: Sequence[Grasp]
    parent: IntArray  # (n,) index of each range's parent
    low: FloatArray  # (n, 4)
    high: FloatArray  # (n, 4)
    fresh: BoolArray  # (n,) whose middle has not been judged

    @classmethod
    def of(cls, grasps: Sequence[Grasp]) -> "Places":
        """What the grasps stand for, in their order."""
        parents = [grasp for grasp in grasps if grasp.leeway is not None]
        leeway = np.array([grasp.leeway for grasp in parents]).reshape(-1, 4, 2)
        count = len(parents)
        low, high = leeway[:, :, 0], leeway[:, :, 1]
        return cls(parents=parents, parent=np.arange(count), low=low, high=high, fresh=np.ones(count, dtype=bool))

    def __len__(self) -> int:
        return len(self.parent)

    @property
    def extents(self) -> FloatArray:
        """How wide each range is, (n, 4)."""
        return np.asarray(self.high - self.low)

    def halved(self, size: FloatArray) -> "Places":
        """Ranges no wider than `size` (4,), made by halving, in the same order."""
        places = self
        while (places.extents > size).any():
            excess = places.extents / size
            which, side = excess.argmax(axis=1), np.arange(len(places))
            twice = np.repeat(side, np.where(excess.max(axis=1) > 1.0, 2, 1))
            upper = np.append(False, twice[1:] == twice[:-1])
            lower = np.append(upper[1:], False)
            low, high, axis = places.low[twice], places.high[twice], which[twice]
            rows = np.arange(len(twice))
            middle = (low[rows, axis] + high[rows, axis]) / 2.0
            high[rows[lower], axis[lower]] = middle[lower]
            low[rows[upper], axis[upper]] = middle[upper]
            places = replace(places, parent=places.parent[twice], low=low, high=high, fresh=places.fresh[twice] | upper | lower)
        return places

    def kept(self, mask: BoolArray) -> "Places":
        """Those where the mask (n,) says so."""
        return replace(self, parent=self.parent[mask], low=self.low[mask], high=self.high[mask], fresh=self.fresh[mask])

    def middles(self) -> list[Grasp]:
        """The grasp in the middle of each range."""
        at = (self.low + self.high) / 2.0
        X = np.array([parent.X_CG for parent in self.parents]).reshape(-1, 4, 4)[self.parent] @ moved(at)
        return [
            replace(self.parents[k], X_CG=X[i], label=f"{self.parents[k].label}, and {_words(at[i])}", leeway=None)
            for i, k in enumerate(self.parent.tolist())
        ]


def hopeless(places: Places, middles: Sequence[Grasp], hand: HandModel, scene: OperationScene, tips_mm: float) -> BoolArray:
    """Ranges in which every grasp collides, (n,): those whose fingers' common core does."""
    none = np.zeros(len(places), dtype=bool)
    if len(places) == 0 or middles[0].grip == SURFACE:  # what a face passes through is no stem: neighbours have no common core
        return none
    opening = max(grasp.opening_width_mm for grasp in middles)
    core = core_hand(hand, middles[0].grip, opening, places.extents.max(axis=0) / 2.0)
    if core is None:
        return none
    hit = np.array([miss is not None for miss in HandCheck(scene, core).roughs(middles, tips_mm)])
    hit[~hit] = _swallowed([grasp for grasp, found in zip(middles, hit, strict=True) if not found], core, scene)
    return hit


def _swallowed(grasps: Sequence[Grasp], hand: HandModel, scene: OperationScene) -> BoolArray:
    """Grasps one of whose open fingers has its middle inside a body, (n,): a core may lie wholly within, and cross no surface."""
    found = np.zeros(len(grasps), dtype=bool)
    if not len(grasps):
        return found
    out_mm = scene.release_clearance_mm / (2.0 if grasps[0].grip == EXTERNAL else -2.0)
    X_CF = np.array([grasp.X_CG @ hand.finger_poses(grasp.opening_width_mm) for grasp in grasps])  # (n, fingers, 4, 4)
    for solid in hand.finger(scene.far_mm, grasps[0].grip):
        middle = np.append(solid.vertices_mm.mean(axis=0) + np.array([out_mm, 0.0, 0.0]), 1.0)
        points_C = (X_CF @ middle).reshape(-1, 4)
        for around, X in (
            (scene.attached, np.eye(4)),
            *((scene.standing, place @ scene.X_PC) for place in scene.motion[[-1, 0]]),
        ):
            found |= around.holds((points_C @ X.T)[:, :3]).reshape(len(grasps), -1).any(axis=1)
    return found


def _words(at: FloatArray) -> str:
    turned, aside, deeper = np.round([np.degrees(at[:2]).sum(), *at[2:]], 1) + 0.0  # no minus zero
    return f"{turned:+.1f}°, {aside:+.1f} mm aside, {deeper:+.1f} mm deeper"
