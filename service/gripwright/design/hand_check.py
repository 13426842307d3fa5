"""Whether a hand is free along one assembly operation.

The hand's volumes: each finger closed on the component along the motion; its opening; its way out along the approach
direction, and in by the same way at the start; the palm behind z = −L with everything behind it, as far as `BEHIND_MM`.
Every volume is convex, neighbours overlap, and the way out leads beyond the scene: where none crosses a surface, none lies
inside a solid either. FCL's answer about surfaces is therefore an answer about solids.

A hand that holds by a face does not close: its closed finger may touch with its front z = 0 alone, and it leaves as it stands.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from gripwright.design.motion import sampled
from gripwright.design.sweeps import Sweeps
from gripwright.design.tapered_hand import leaving_mm, way_out
from gripwright.domain.grasp import EXTERNAL, SURFACE, Grasp, letting_go
from gripwright.domain.shape import FloatArray, IntArray
from gripwright.geometry.collision import ConvexShape, Scene
from gripwright.geometry.polytope import Faces, Polytope
from gripwright.geometry.solids import dilated, swept
from gripwright.plugin_api import HandModel

BEHIND_MM = 300.0  # actuator, tool changer and wrist: nothing may come nearer to the palm's back
LENGTH_LIMIT_MM = 250.0  # longer fingers are not considered
_FAR_STEP_MM = 100.0  # so that bodies which change a little leave the shapes of all others as they were
ENTER_MM = 0.004  # a closed finger's gripping surface, or a face, is drawn back by this against the component that it touches
ROUGH_MM = 0.3  # before the grasp is seated
_TOGETHER = 256  # grasps that are reckoned together


@dataclass(frozen=True, slots=True, kw_only=True)
class Miss:
    """Why a grasp fails: how far it came (a higher stage is nearer to success), code and sentence."""

    stage: int
    code: str
    detail: str
    grasp: Grasp | None = field(default=None, compare=False)  # as it was planned


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OperationScene:
    """What surrounds the hand: `attached` moves with it (component frame), `standing` does not (product frame)."""

    attached: Scene
    standing: Scene
    X_PC: FloatArray  # (4, 4) the held component at its place
    motion: FloatArray  # (k, 4, 4) displacements of the active subassembly
    margin_mm: float
    release_clearance_mm: float

    @property
    def far_mm(self) -> float:
        """A way out that leads beyond everything."""
        low = np.concatenate([self.attached.low, self.standing.low]).min(axis=0)
        high = np.concatenate([self.attached.high, self.standing.high]).max(axis=0)
        travel = float(np.linalg.norm(self.motion[:, :3, 3], axis=1).max())
        far = float(np.linalg.norm(high - low)) + travel + float(np.linalg.norm(self.X_PC[:3, 3])) + 50.0
        return _FAR_STEP_MM * float(np.ceil(far / _FAR_STEP_MM))


class HandCheck:
    """Checks of grasps in one operation. Geometry is cached over grasps; nothing else is kept."""

    def __init__(self, scene: OperationScene, hand: HandModel) -> None:
        self.scene, self.hand = scene, hand
        self.sweeps = Sweeps(scene.motion)
        self.turning = self.sweeps.turning
        self.far_mm = scene.far_mm
        self._start, self._end = scene.motion[0], scene.motion[-1]
        self._glances = sampled(scene.motion[[0, -1]], 4)[:0:-1]  # from the end, where things are close
        self._fingers: dict[tuple[str, float], list[FloatArray]] = {}
        self._ways: dict[tuple[str, float], list[FloatArray]] = {}
        self._palms: dict[float, list[tuple[Polytope, Faces]]] = {}

    def rough(self, grasp: Grasp, tips_mm: float) -> Miss | None:
        """Why the open hand cannot leave, or the tips (`tips_mm` long) cannot close: before the grasp is seated."""
        return self._misses([grasp], tips_mm, ROUGH_MM)[0]

    def roughs(self, grasps: Sequence[Grasp], tips_mm: float) -> Iterator[Miss | None]:
        """As `rough` for each of many grasps of one grip, reckoned together as they are asked for."""
        for start in range(0, len(grasps), _TOGETHER):
            yield from self._misses(grasps[start : start + _TOGETHER], tips_mm, ROUGH_MM)

    def seated(self, grasp: Grasp, finger_length_mm: float) -> Miss | None:
        """Why the seated grasp is not free with stems of that length (the palm aside)."""
        return self._misses([grasp], finger_length_mm, ENTER_MM)[0]

    def _misses(self, grasps: Sequence[Grasp], length_mm: float, draw_back_mm: float) -> list[Miss | None]:
        """For each grasp the first thing that its fingers hit, or None."""
        among = _Candidates(grasps, self.hand)
        way_out = self._way_out(among.grasp, length_mm)
        self._leave_attached(among, way_out)
        self._closed_attached(among, length_mm, draw_back_mm)
        self._leave_standing(among, way_out)
        self._along_motion(among, length_mm)
        return among.misses

    def gap(self, grasp: Grasp, finger_length_mm: float, limit_mm: float) -> float:
        """Least distance of the closed fingers to the standing scene at some poses of the motion, at most `limit_mm`."""
        best = limit_mm
        for X_GF in self.hand.finger_poses(grasp.opening_width_mm):
            for vertices in self.finger(grasp, finger_length_mm):
                for place in self._glances:
                    X_PF = place @ self.scene.X_PC @ grasp.X_CG @ X_GF
                    best = self.scene.standing.distance(self._cached(vertices), X_PF, best)[0]
        return best

    def palm(self, envelope_mm: float) -> list[tuple[Polytope, Faces]]:
        """The palm's solids at L = 0 with the margin around them, each with what it passes through on its way out, frame G."""
        if envelope_mm not in self._palms:
            depth = BEHIND_MM + LENGTH_LIMIT_MM  # so that what is free at one length is free at every greater one
            palm = self.hand.palm(0.0, envelope_mm, depth)
            solids = [Polytope(dilated(solid.vertices_mm, self.scene.margin_mm)) for solid in palm]
            out = np.array([0.0, 0.0, -self.far_mm])
            self._palms[envelope_mm] = [(solid, solid.swept(out)) for solid in solids]
        return self._palms[envelope_mm]

    @property
    def ends(self) -> tuple[FloatArray, FloatArray]:
        """Where the active subassembly is let go and where it is taken up, (4, 4) each."""
        return self._end, self._start

    def finger(self, grasp: Grasp, length_mm: float) -> list[FloatArray]:
        """A finger's solids, frame F."""
        key = (grasp.grip, length_mm)
        if key not in self._fingers:
            self._fingers[key] = [solid.vertices_mm for solid in self.hand.finger(length_mm, grasp.grip)]
        return self._fingers[key]

    def closing(self, grasp: Grasp, vertices: FloatArray, draw_back_mm: float) -> FloatArray:
        """What a finger's solid passes through as it closes on the component, but for the layer next to it, frame F."""
        return drawn_back(self.opening(grasp, vertices), draw_back_mm, grasp)

    def opening(self, grasp: Grasp, vertices: FloatArray) -> FloatArray:
        """What a finger's solid passes through as it lets go, frame F."""
        return swept(vertices, np.array([self._out(grasp), 0.0, 0.0]))

    # --- volumes -------------------------------------------------------------------------------------------------------

    def _way_out(self, grasp: Grasp, length_mm: float) -> list[FloatArray]:
        """What a finger passes through on its way out beyond the scene, frame F."""
        way_mm = way_length_mm(grasp, length_mm, self.far_mm)
        key = (grasp.grip, way_mm)
        if key not in self._ways:
            self._ways[key] = [solid.vertices_mm for solid in way_out(self.hand, way_mm, grasp.grip)]
        return leaving(self._ways[key], grasp, self.far_mm)

    def _out(self, grasp: Grasp) -> float:
        """Way of each gripping surface while the hand lets go, along the finger's +x."""
        return letting_go(grasp.grip) * (self.scene.release_clearance_mm + leaving_mm(self.hand)) / 2.0

    def _leave_attached(self, among: "_Candidates", way_out: Sequence[FloatArray]) -> None:
        out, attached = self._out(among.grasp), self.scene.attached
        for number, vertices in among.each_finger(way_out):
            grown = dilated(vertices + np.array([out, 0.0, 0.0]), min(self.scene.margin_mm, abs(out) * 0.8))
            if out == 0.0:
                grown = drawn_back(grown, ROUGH_MM, among.grasp)
            hits = attached.first_hits(self._cached(grown), among.X_CF(number))
            among.drop(hits, attached.names, 0, f"open finger {number} cannot reach the surface past {{}}")

    def _closed_attached(self, among: "_Candidates", length_mm: float, draw_back_mm: float) -> None:
        attached = self.scene.attached
        for number, vertices in among.each_finger(self.finger(among.grasp, length_mm)):
            opened = self.closing(among.grasp, vertices, draw_back_mm)
            hits = attached.first_hits(self._cached(opened), among.X_CF(number))
            among.drop(hits, attached.names, 1, f"finger {number} would enter {{}} while it closes")

    def _leave_standing(self, among: "_Candidates", way_out: Sequence[FloatArray]) -> None:
        standing = self.scene.standing
        for place, words in ((self._end, "after the operation"), (self._start, "before the operation")):
            for number, vertices in among.each_finger(way_out):
                opened = dilated(vertices + np.array([self._out(among.grasp), 0.0, 0.0]), self.scene.margin_mm)
                hits = standing.first_hits(self._cached(opened), place @ self.scene.X_PC @ among.X_CF(number))
                among.drop(hits, standing.names, 2, f"open finger {number} hits {{}} {words}")

    def _along_motion(self, among: "_Candidates", length_mm: float) -> None:
        margin, standing = self.scene.margin_mm, self.scene.standing
        for number, vertices in among.each_finger(self.finger(among.grasp, length_mm)):
            opened = dilated(self.opening(among.grasp, vertices), margin)
            for place, words in ((self._end, "while it opens"), (self._start, "while it closes")):
                hits = standing.first_hits(self._cached(opened), place @ self.scene.X_PC @ among.X_CF(number))
                among.drop(hits, standing.names, 3, f"finger {number} hits {{}} {words}")
            hits = self.sweeps.first_hits(standing, vertices, margin, self.scene.X_PC @ among.X_CF(number))
            among.drop(hits, standing.names, 3, f"finger {number} hits {{}} on the way")

    def _cached(self, vertices: FloatArray) -> ConvexShape:
        return self.sweeps.still(vertices)


class _Candidates:
    """Grasps of one grip, those among them that nothing has been found against, and what was found against the others."""

    def __init__(self, grasps: Sequence[Grasp], hand: HandModel) -> None:
        self.grasp = grasps[0]
        self.misses: list[Miss | None] = [None] * len(grasps)
        self._left = np.arange(len(grasps))
        fingers = {width: hand.finger_poses(width) for width in {grasp.opening_width_mm for grasp in grasps}}
        self._X_CF = np.array([grasp.X_CG @ fingers[grasp.opening_width_mm] for grasp in grasps])  # (n, fingers, 4, 4)

    def each_finger(self, solids: Sequence[FloatArray]) -> Iterator[tuple[int, FloatArray]]:
        """(number of the finger from 1 on, solid), as long as a grasp is left."""
        for number in range(1, self._X_CF.shape[1] + 1):
            for vertices in solids:
                if len(self._left):
                    yield number, vertices

    def X_CF(self, number: int) -> FloatArray:
        """Poses (k, 4, 4) of that finger of the grasps that are left."""
        return np.asarray(self._X_CF[self._left, number - 1])

    def drop(self, hits: IntArray, names: Sequence[str], stage: int, words: str) -> None:
        """Note what the grasps that are left hit (−1: nothing); `words` has {} for its name."""
        for row, hit in zip(self._left[hits >= 0].tolist(), hits[hits >= 0].tolist(), strict=True):
            self.misses[row] = Miss(stage=stage, code="collision", detail=words.format(names[hit]))
        self._left = self._left[hits < 0]


def way_length_mm(grasp: Grasp, length_mm: float, far_mm: float) -> float:
    """The length of finger that is asked for a way out: a stem is long enough to hold all of it, a face is swept along it."""
    return length_mm if grasp.grip == SURFACE else far_mm


def leaving(solids: Sequence[FloatArray], grasp: Grasp, far_mm: float) -> list[FloatArray]:
    """What a finger's solids (of `way_length_mm`) pass through on their way out along the approach direction, frame F."""
    out = np.array([0.0, 0.0, -far_mm])
    return [swept(vertices, out) for vertices in solids] if grasp.grip == SURFACE else list(solids)


def drawn_back(vertices: FloatArray, by_mm: float, grasp: Grasp) -> FloatArray:
    """The finger without the layer next to its gripping surface, which may be hollow."""
    if grasp.grip == SURFACE:
        return np.asarray(np.minimum(vertices, [np.inf, np.inf, -by_mm]))
    if grasp.grip == EXTERNAL:
        return np.asarray(np.minimum(vertices + np.array([by_mm, 0.0, 0.0]), [vertices[:, 0].max(), np.inf, np.inf]))
    return np.maximum(vertices - [by_mm, 0.0, 0.0], [vertices[:, 0].min(), -np.inf, -np.inf])  # a nose is drawn back whole
