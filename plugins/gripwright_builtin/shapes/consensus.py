"""Which of many proposed forms a surface follows: consensus chooses, least squares on the true corners decides.

Lengths are shares of the patches' size.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, Self, TypeVar

import numpy as np
from scipy.optimize import least_squares

from gripwright.domain.shape import BoolArray, FloatArray
from gripwright_builtin.shapes.patches import FlatPatches

_LOOSE = 0.04  # distance within which a corner speaks for a proposal: the middles of coarse facets lie so far inside
_EXACT = 1e-4  # closer is exact
_ROUNDS = 5
_TRIES = 3  # proposals that are fitted
_LOOKED_AT = 300  # patches that judge proposals
_POINTS = 600  # corners that least squares looks at
_STEPS = 12  # of least squares in a round
_SIGMA = 1.4826  # of a median of distances, for noise
_LEAST = 4  # patches


class Form(Protocol):
    """A surface without ends."""

    @property
    def free(self) -> int:
        """How many numbers say how it may move and grow."""
        ...

    def distances(self, points: FloatArray) -> FloatArray:
        """Signed distance of points (n, 3), positive outside, (n,)."""
        ...

    def cosines(self, points: FloatArray, facing: FloatArray) -> FloatArray:
        """How far normals (n, 3) at points face away from it: 1, against it −1, (n,); nan where it has no normal."""
        ...

    def moved(self, step: FloatArray) -> Self:
        """The form after small changes, (free,)."""
        ...


FormT = TypeVar("FormT", bound=Form)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found(Generic[FormT]):
    """A fitted form and the patches that follow it."""

    form: FormT
    sign: float  # +1 a solid, −1 a hollow of that form
    near: BoolArray  # (k,)
    rms: float  # of the corners' distances, by area
    score: float  # area that follows, times the digits of its closeness


def consensus(patches: FlatPatches, proposals: Sequence[FormT], cosine: float) -> Found[FormT] | None:
    """The form that most of the surface follows most closely; normals may turn away by the angle of that cosine."""
    few = patches.select(np.arange(0, len(patches.areas), len(patches.areas) // _LOOKED_AT + 1))
    scored = []
    for form in proposals:
        off, turned = _looked_at(few, form)
        fade = few.areas * np.maximum(1.0 - (off / _LOOSE) ** 2, 0.0)
        scored += [(float(fade @ (turned * sign >= cosine)), sign, form) for sign in (1.0, -1.0)]
    scored.sort(key=lambda one: -one[0])
    fitted = [_refined(patches, form, sign, cosine) for score, sign, form in scored[:_TRIES] if score > 0.0]
    return max((one for one in fitted if one is not None), key=lambda one: one.score, default=None)


def _looked_at(patches: FlatPatches, form: Form) -> tuple[FloatArray, FloatArray]:
    """The distance of each patch's farthest corner, and how far the patch faces away from the form, (k,) each."""
    off = np.maximum.reduceat(np.abs(form.distances(patches.points)), patches.start)
    cosines = form.cosines(patches.points, patches.facing)
    known = np.isfinite(cosines)
    total = np.add.reduceat(np.where(known, cosines, 0.0), patches.start)
    return off, total / np.maximum(np.add.reduceat(known.astype(float), patches.start), 1.0)


def _refined(patches: FlatPatches, form: FormT, sign: float, cosine: float) -> Found[FormT] | None:
    """The form fitted to what follows it, again and again, each time with what follows as closely as most do."""
    limit, rms = _LOOSE, 0.0
    near = np.zeros(len(patches.areas), dtype=bool)
    for _ in range(_ROUNDS):
        off, turned = _looked_at(patches, form)
        near = (off <= limit) & (turned * sign >= cosine)
        if near.sum() < _LEAST:
            return None
        chosen = patches.select(near)
        fitted = _fitted(form, chosen.points, chosen.weights)
        if fitted is None:
            return None
        form = fitted
        distances = np.abs(form.distances(chosen.points))
        rms = float(np.sqrt(np.average(distances**2, weights=chosen.weights)))
        limit = min(_LOOSE, max(4.0 * _SIGMA * _median(distances, chosen.weights), _EXACT))
    area = float(patches.areas[near].sum())
    return Found(form=form, sign=sign, near=near, rms=rms, score=area * float(np.log(2.0 * _LOOSE / max(rms, _EXACT))))


def _fitted(form: FormT, points: FloatArray, weights: FloatArray) -> FormT | None:
    every = len(points) // _POINTS + 1
    points, weights = points[::every], weights[::every]
    if len(points) < form.free:
        return None
    root = np.sqrt(weights / weights.sum())

    def distances(step: FloatArray) -> FloatArray:
        return np.asarray(root * form.moved(step).distances(points))

    found = least_squares(distances, np.zeros(form.free), method="lm", max_nfev=_STEPS).x
    return form.moved(found) if np.isfinite(found).all() else None


def _median(values: FloatArray, weights: FloatArray) -> float:
    order = np.argsort(values)
    return float(values[order][np.searchsorted(np.cumsum(weights[order]), weights.sum() / 2.0)])
