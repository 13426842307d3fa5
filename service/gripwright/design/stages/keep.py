"""Stage keep: of several analyses of one component, the one whose primitives explain most of its surface (`segmenter=best`)."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from gripwright.domain.shape import Analysis, FollowedPrimitive, Mesh, Primitive, Segment
from gripwright.geometry.measures import face_areas_mm2, face_centres_mm, face_normals

TOLERANCE = 0.002
"""Distance from a primitive up to which surface lies on it, as a fraction of the root of the component's area."""
ANGLE_RAD = float(np.radians(20.0))
"""Angle to the primitive up to which it does: more than the facets of a coarse cylinder turn."""
TIE = 0.01
"""Shares that differ by no more are equal: then the analysis named first is kept."""


def keep(analyses: Sequence[Analysis]) -> Analysis:
    """The analysis that explains most, with a remark that names the shares of all, and what all of them cost."""
    shares = [explained_share(analysis) for analysis in analyses]
    most = max(shares)
    best = next(number for number, share in enumerate(shares) if share >= most - TIE)
    kept = analyses[best]
    timings = dict(kept.timings)
    for other in analyses:
        for key, seconds in other.timings.items():
            if other is not kept and not key.startswith("prepare."):  # all of them share it
                timings[key] = timings.get(key, 0.0) + seconds
    return dataclasses.replace(
        kept,
        timings=timings,
        sdf=next((analysis.sdf for analysis in analyses if analysis.sdf is not None), None),
        remarks=(*kept.remarks, _remark(analyses, shares, best)),
    )


def explained_share(analysis: Analysis) -> float:
    """Part of the component's area that lies on the primitive of its segment, 0..1."""
    kept = [(item.primitive, item.segment) for item in analysis.segments if item.primitive is not None]
    explained = sum(explained_mm2(primitive, segment, analysis.mesh) for primitive, segment in kept)
    return explained / float(face_areas_mm2(analysis.mesh).sum())


def explained_mm2(primitive: Primitive, segment: Segment, mesh: Mesh) -> float:
    """Area of a segment of the mesh on the primitive; all or nothing, by its rms, where the primitive cannot say which."""
    areas_mm2 = face_areas_mm2(mesh)
    tolerance_mm = TOLERANCE * float(np.sqrt(areas_mm2.sum()))
    if not isinstance(primitive, FollowedPrimitive):
        return segment.area_mm2 if primitive.rms_mm <= tolerance_mm else 0.0
    part = Mesh(vertices_mm=mesh.vertices_mm, faces=mesh.faces[segment.faces])
    follows = primitive.follows(face_centres_mm(part), face_normals(part), tolerance_mm, ANGLE_RAD)
    return float(areas_mm2[segment.faces[follows]].sum())


def _remark(analyses: Sequence[Analysis], shares: Sequence[float], best: int) -> str:
    kept, others = analyses[best], [number for number in range(len(analyses)) if number != best]
    listed = ", ".join(f"those of {analyses[number].segmenter} {100 * shares[number]:.1f} %" for number in others)
    equal = all(abs(shares[number] - shares[best]) <= TIE for number in others)
    why = " (a tie: the first is kept)" if equal else ""
    return f"{kept.segmenter} kept: its primitives explain {100 * shares[best]:.1f} % of the surface, {listed}{why}"
