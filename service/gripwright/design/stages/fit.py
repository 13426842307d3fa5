"""Stage fit: every fitter looks at a segment, the primitive that explains its volume best is kept (paper, section 4.2)."""

from collections.abc import Callable, Mapping
from typing import Any

from gripwright.domain.assembly import Component
from gripwright.domain.errors import Rejection
from gripwright.domain.shape import Primitive, Segment, SegmentAnalysis
from gripwright.plugin_api import PrimitiveFitter, RunContext

ALIKE = 1e-6
"""Share of the hull's volume by which volumes that count as the same may differ."""


def fit(
    component: Component,
    segment: Segment,
    fitters: Mapping[str, PrimitiveFitter],
    ctx: RunContext,
    check: Callable[[str, Primitive], object] = lambda key, primitive: None,
) -> SegmentAnalysis:
    """The primitive whose volume is closest to that of the segment's convex hull, of those with a filled surface.

    Of those alike within `ALIKE` the one of the fitter named first. The other filled ones stay as alternatives, the next best
    first. `ctx.timings` gains "fit.<fitter>". `check` sees each primitive, with its fitter, and raises where it cannot be used.
    """
    outcomes: dict[str, Primitive | Rejection] = {}
    for key, fitter in fitters.items():
        with ctx.timed(f"fit.{key}"):
            outcomes[key] = outcome = fitter.fit(component, segment, ctx)
        if not isinstance(outcome, Rejection):
            check(key, outcome)
    filled = {k: p for k, p in outcomes.items() if not isinstance(p, Rejection) and p.surface_filled}
    ranked = sorted(filled, key=lambda key: _off(filled[key], segment))
    kept = ranked[0] if ranked else None
    return SegmentAnalysis(
        segment=segment,
        primitive=filled[kept] if kept else None,
        fits=tuple(_record(key, outcome, segment, key == kept) for key, outcome in outcomes.items()),
        reason=_reason(outcomes, segment, kept),
        alternatives=tuple(filled[key] for key in ranked[1:]),
    )


def _off(primitive: Primitive, segment: Segment) -> float:
    """How far the volumes are apart, in steps of `ALIKE` of the hull's: a prism is an extrusion, too, but for rounding."""
    off = abs(primitive.volume_mm3 - segment.hull_volume_mm3)
    return round(off / (ALIKE * segment.hull_volume_mm3)) if segment.hull_volume_mm3 > 0 else off


def _record(key: str, outcome: Primitive | Rejection, segment: Segment, kept: bool) -> dict[str, Any]:
    if isinstance(outcome, Rejection):
        return {"fitter": key, "kept": False, "code": outcome.code, "detail": outcome.detail}
    return {
        "fitter": key,
        "kind": outcome.kind,
        "volume_ratio": volume_ratio(outcome, segment),
        "surface_filled": outcome.surface_filled,
        "rms": outcome.rms_mm,
        "kept": kept,
        **outcome.to_dict(),
    }


def volume_ratio(primitive: Primitive, segment: Segment) -> float | None:
    """Volume of the primitive over that of the segment's convex hull; None for a flat segment."""
    return primitive.volume_mm3 / segment.hull_volume_mm3 if segment.hull_volume_mm3 > 0 else None


def _reason(outcomes: Mapping[str, Primitive | Rejection], segment: Segment, kept: str | None) -> str:
    others = "; ".join(_says(key, outcome, segment) for key, outcome in outcomes.items() if key != kept)
    if kept is None:
        return f"no shape to grip was found: {others}" if others else "no fitter was asked"
    chosen = outcomes[kept]
    assert not isinstance(chosen, Rejection)
    ratio = volume_ratio(chosen, segment)
    share = "a flat segment" if ratio is None else f"{ratio:.2f} of the hull's volume"
    return f"{kept} kept with {share}" + (f"; {others}" if others else "")


def _says(key: str, outcome: Primitive | Rejection, segment: Segment) -> str:
    if isinstance(outcome, Rejection):
        return f"{key}: {outcome.detail}"
    ratio = volume_ratio(outcome, segment)
    share = "flat segment" if ratio is None else f"{ratio:.2f} of the hull's volume"
    return f"{key}: {share}" if outcome.surface_filled else f"{key}: {share}, but too little of the segment's surface lies on it"
