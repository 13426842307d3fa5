"""Screw threads levelled, so that segmentation sees the rod or the bore that they run round.

A thread shows itself as a strip: surface between creases that is several turns about one axis long and narrower than its
pitch. Teeth, grooves, knurls and rings of fins are no such strips: theirs are one turn long at most, or as wide as the part
is long. Of what lies beyond its creases only the rim moves.
"""

from dataclasses import dataclass

import numpy as np

from gripwright.domain.shape import FloatArray, IntArray, Mesh
from gripwright.geometry.adjacency import connected_labels, edge_lengths_mm, exterior_angles_rad, face_adjacency
from gripwright.geometry.measures import face_areas_mm2, face_centres_mm, face_normals, submesh

CREASE_RAD = np.radians(20.0)
"""Surface turns more sharply at the edges between crest, flank and root."""
TURNS_MIN = 2.0
PITCH_MAX = 1.0
"""Largest pitch, as a fraction of the mean radius."""
WIDTH_MAX = 1.2
"""Largest width of a strip, as a fraction of the pitch; a toothed rim is as wide as it is long, at two turns and more."""
LENGTH_MIN = 4.0
"""Least length of a strip, as a multiple of the root of its area: shorter patches are not looked at."""
FACES_MIN = 32
RELIEF_LEFT = 0.02
"""Fraction of the relief that stays, so that no face loses its area."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Thread:
    """Faces of one thread and the cylinder about which they lie."""

    faces: IntArray  # (k,)
    axis: FloatArray  # (3,) unit
    point_mm: FloatArray  # (3,) on the axis
    pitch_mm: float


def threads(mesh: Mesh) -> tuple[Thread, ...]:
    """The threads of a mesh with merged vertices; strips that touch each other are one thread."""
    adjacency = face_adjacency(mesh)
    sharp = np.abs(exterior_angles_rad(mesh, adjacency)) > CREASE_RAD
    patch = connected_labels(adjacency.pairs[~sharp], len(mesh.faces))
    area, count = np.bincount(patch, weights=face_areas_mm2(mesh)), np.bincount(patch)
    borders = patch[adjacency.pairs[sharp]]  # (b, 2)
    length = np.bincount(borders.ravel(), np.repeat(edge_lengths_mm(mesh, adjacency)[sharp], 2), len(count)) / 2.0
    pitch_mm = np.zeros(len(count))
    for i in np.flatnonzero((count >= FACES_MIN) & (area > 0) & (length**2 > LENGTH_MIN**2 * area)):
        pitch_mm[i] = _pitch_mm(submesh(mesh, np.flatnonzero(patch == i)), float(length[i]))
    thread = connected_labels(borders[(pitch_mm[borders] > 0).all(axis=1)], len(count))  # of each patch
    found = []
    for number in np.unique(thread[pitch_mm > 0]):
        strips = (thread == number) & (pitch_mm > 0)
        faces = np.flatnonzero(strips[patch])
        axis, point_mm, _ = _axis(submesh(mesh, faces))
        found.append(Thread(faces=faces, axis=axis, point_mm=point_mm, pitch_mm=float(np.median(pitch_mm[strips]))))
    return tuple(found)


def levelled_mm(mesh: Mesh, thread: Thread) -> FloatArray:
    """The mesh's vertices, (n, 3), those of the thread moved to the thread's mean radius within a pitch along its axis."""
    along, out, radius = _about_axis(face_centres_mm(mesh)[thread.faces], thread)
    order = np.argsort(along, kind="stable")
    weights = face_areas_mm2(mesh)[thread.faces][order]
    total = np.concatenate(([0.0], np.cumsum(weights)))
    moment = np.concatenate(([0.0], np.cumsum(weights * radius[order])))
    moved = np.unique(mesh.faces[thread.faces])
    height, out, radius = _about_axis(mesh.vertices_mm[moved], thread)
    first, last = (np.searchsorted(along[order], height + side * thread.pitch_mm / 2.0) for side in (-1.0, 1.0))
    within = total[last] - total[first]
    mean = np.where(within > 0, (moment[last] - moment[first]) / np.where(within > 0, within, 1.0), radius)
    vertices = mesh.vertices_mm.copy()
    vertices[moved] += ((1.0 - RELIEF_LEFT) * (mean - radius))[:, None] * out
    return vertices


def _about_axis(points_mm: FloatArray, thread: Thread) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Coordinate along the axis (k,), unit vector away from it (k, 3) and distance from it (k,) of points (k, 3)."""
    offset = points_mm - thread.point_mm
    along = offset @ thread.axis
    across = offset - np.outer(along, thread.axis)
    radius = np.linalg.norm(across, axis=1)
    return along, across / np.maximum(radius, np.finfo(float).tiny)[:, None], radius


def _pitch_mm(strip: Mesh, length_mm: float) -> float:
    """Pitch of a strip of that length; 0 where it is no helix."""
    axis, point_mm, radius_mm = _axis(strip)
    height = float(np.ptp((strip.vertices_mm - point_mm) @ axis))
    turns = length_mm / (2.0 * np.pi * max(radius_mm, np.finfo(float).tiny))
    width = float(face_areas_mm2(strip).sum()) / length_mm
    fits = turns >= TURNS_MIN and height <= PITCH_MAX * radius_mm * turns and width * turns <= WIDTH_MAX * height
    return height / turns if fits else 0.0


def _axis(strip: Mesh) -> tuple[FloatArray, FloatArray, float]:
    """Axis about which faces lie, the point on it nearest to their middle, and their mean distance from it."""
    areas, normals, centres = face_areas_mm2(strip), face_normals(strip), face_centres_mm(strip)
    values, vectors = np.linalg.eigh((normals * areas[:, None]).T @ normals)
    axis = vectors[:, 0] if values[1] - values[0] > values[2] - values[1] else vectors[:, 2]  # across it all is alike
    middle = np.average(centres, axis=0, weights=areas)
    across = (centres - middle) - np.outer((centres - middle) @ axis, axis)  # (k, 3)
    # Circle of least squares, |x|² = 2 c·x + const; least squares of smallest norm leave c no part along the axis.
    rows = np.column_stack((2.0 * across, np.ones(len(across))))
    root = np.sqrt(areas)
    centre = np.linalg.lstsq(rows * root[:, None], (across**2).sum(axis=1) * root, rcond=1e-9)[0][:3]
    return axis, middle + centre, float(np.average(np.linalg.norm(across - centre, axis=1), weights=areas))
