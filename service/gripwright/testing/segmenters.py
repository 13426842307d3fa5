"""Checks of segmenters: a partition of the faces."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gripwright.domain.shape import Mesh, Segment
from gripwright.geometry.adjacency import connected_labels, exterior_angles_rad, face_adjacency
from gripwright.geometry.measures import face_areas_mm2
from gripwright.testing.trial import Case, Check, Trial

_EDGE_RAD = np.radians(20.0)  # above the turn between the facets of a sample's round surface


def cases(trial: Trial) -> list[Case]:
    """One a component, as if read from STEP, and one whose file has triangles alone."""
    samples = [(sample.name, sample.component) for sample in trial.components]
    of_step = [(name, replace(component, mesh=_with_cad_faces(component.mesh))) for name, component in samples]
    named = [*of_step, ("triangles alone", samples[0][1])]
    return [Case(name=name, method="segment", arguments={"component": component}) for name, component in named]


def _with_cad_faces(mesh: Mesh) -> Mesh:
    """The mesh with the faces (planes, cylinders, …) of the exact solid: they end at its edges."""
    adjacency = face_adjacency(mesh)
    smooth = np.abs(exterior_angles_rad(mesh, adjacency)) < _EDGE_RAD
    return replace(mesh, cad_faces=connected_labels(adjacency.pairs[smooth], len(mesh.faces)))


def partition(trial: Trial) -> Iterable[str]:
    """Every face is in exactly one segment, and the segments say how large they are."""
    answers = list(trial.answers())
    if not answers:
        yield "every sample is rejected"
    for case, segments in answers:
        mesh = case.arguments["component"].mesh
        yield from (f"{case.name}: {fault}" for fault in _partition_faults(mesh, segments))


def _partition_faults(mesh: Mesh, segments: Any) -> Iterable[str]:
    if not isinstance(segments, Sequence) or not all(isinstance(segment, Segment) for segment in segments):
        yield f"segment returns {type(segments).__name__}, not a sequence of Segment"
        return
    if [segment.id for segment in segments] != list(range(len(segments))):
        yield f"ids are {[segment.id for segment in segments]}, they must count from 0"
    everything = np.concatenate([segment.faces for segment in segments] or [np.zeros(0, dtype=np.int64)])
    if not np.issubdtype(everything.dtype, np.integer) or (everything < 0).any() or (everything >= len(mesh.faces)).any():
        yield f"faces must be integers from 0 to {len(mesh.faces) - 1}"
        return
    count = np.bincount(everything, minlength=len(mesh.faces))
    if (count > 1).any():
        yield f"face {int(np.argmax(count > 1))} is in more than one segment ({int((count > 1).sum())} faces are)"
    if (count == 0).any():
        yield f"face {int(np.argmax(count == 0))} is in no segment ({int((count == 0).sum())} faces are in none)"
    areas = face_areas_mm2(mesh)
    for segment in segments:
        if (np.diff(segment.faces) <= 0).any():
            yield f"the faces of segment {segment.id} are not ascending"
        area = float(areas[segment.faces].sum())
        if not np.isclose(segment.area_mm2, area, rtol=1e-6):
            yield f"segment {segment.id} states an area of {segment.area_mm2:.6g} mm², its faces have {area:.6g} mm²"
        if not (np.isfinite(segment.hull_volume_mm3) and segment.hull_volume_mm3 >= 0):
            yield f"segment {segment.id} states a hull volume of {segment.hull_volume_mm3} mm³"


CHECKS = (Check("partition", "every face is in exactly one segment", partition),)
