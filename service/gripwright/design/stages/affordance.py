"""Stage affordance: surface that no finger may touch (paper, section 5.2.1)."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from gripwright.domain.affordance import MARKED, Forbidden
from gripwright.domain.assembly import Component, GraspRegion
from gripwright.domain.errors import Rejection
from gripwright.domain.shape import BoolArray, Mesh, Segment
from gripwright.geometry.measures import face_areas_mm2, face_centres_mm
from gripwright.plugin_api import AffordanceDetector, RunContext

WHOLLY = 0.99
"""Share of a segment's area from which it counts as wholly forbidden: what is left over are slivers along its border."""


def forbidden(
    component: Component, segments: Sequence[Segment], detectors: Mapping[str, AffordanceDetector], ctx: RunContext
) -> tuple[Forbidden, ...]:
    """What the detectors forbid of the component's prepared mesh.

    The user's word wins in both directions: `may_grasp` frees what was detected, never what `no_grasp` marks.
    """
    allowed = _allowed(component, segments)
    found: list[Forbidden] = []
    for key, detector in detectors.items():
        with ctx.timed(f"affordance.{key}"):
            for region in detector.detect(component, segments, ctx):
                kept = region if region.detector == MARKED else replace(region, faces=region.faces & ~allowed)
                if kept.faces.any():
                    found.append(kept)
    return tuple(found)


def segment_forbidden(mesh: Mesh, segment: Segment, regions: Sequence[Forbidden]) -> Rejection | None:
    """`no-grasp` where at least `WHOLLY` of the segment's area may not be touched, else None."""
    areas = face_areas_mm2(mesh)[segment.faces]
    covered = np.zeros(len(segment.faces), dtype=bool)
    shares: dict[str, float] = {}
    for region in regions:
        inside = region.faces[segment.faces] & _inside(mesh, segment, region)
        shares[region.reason] = shares.get(region.reason, 0.0) + float(areas[inside & ~covered].sum())
        covered |= inside
    share = float(areas[covered].sum()) / max(float(areas.sum()), 1e-300)
    if share < WHOLLY:
        return None
    reasons = ", ".join(reason for reason, area in sorted(shares.items(), key=lambda item: -item[1]) if area > 0)
    return Rejection(
        "no-grasp", f"{reasons}: {100 * share:.1f} % of the segment may not be touched, less than {100 * WHOLLY:.0f} % needed"
    )


def marked_shares(mesh: Mesh, segment: Segment, regions: Sequence[Forbidden]) -> dict[str, float]:
    """The share of the segment's area that may not be touched, by reason."""
    areas = face_areas_mm2(mesh)[segment.faces]  # (k,)
    marked: dict[str, BoolArray] = {}
    for region in regions:
        inside = region.faces[segment.faces] & _inside(mesh, segment, region)
        marked[region.reason] = marked.get(region.reason, np.zeros(len(inside), dtype=bool)) | inside
    total = max(float(areas.sum()), 1e-300)
    return {reason: float(areas[faces].sum()) / total for reason, faces in marked.items() if faces.any()}


def _allowed(component: Component, segments: Sequence[Segment]) -> BoolArray:
    """Faces that `may_grasp` names: of its segments, or with their centre in its box (closed), (m,)."""
    centres = face_centres_mm(component.mesh)
    allowed = np.zeros(len(centres), dtype=bool)
    for region in component.may_grasp:
        allowed |= _named(region, segments, len(centres))
        if region.box_min_C is not None and region.box_max_C is not None:
            allowed |= ((centres >= region.box_min_C) & (centres <= region.box_max_C)).all(axis=1)
    return allowed


def _named(region: GraspRegion, segments: Sequence[Segment], count: int) -> BoolArray:
    named = np.zeros(count, dtype=bool)
    for segment in segments:
        if segment.id in region.segments:
            named[segment.faces] = True
    return named


def _inside(mesh: Mesh, segment: Segment, region: Forbidden) -> BoolArray:
    """Which of the segment's faces lie wholly in the region's box, (k,); all of them where it has none."""
    if region.box_min_C is None or region.box_max_C is None:
        return np.ones(len(segment.faces), dtype=bool)
    triangles = mesh.vertices_mm[mesh.faces[segment.faces]]  # (k, 3, 3)
    return np.asarray(((triangles >= region.box_min_C) & (triangles <= region.box_max_C)).all(axis=(1, 2)))
