"""Stage 2: the segmenter of the plan, held to its contract; labels for the faces of the file."""

from collections.abc import Sequence

import numpy as np

from gripwright.domain.assembly import Component
from gripwright.domain.errors import PluginFailure, Rejection
from gripwright.domain.shape import IntArray, Mesh, Segment
from gripwright.geometry.measures import face_areas_mm2
from gripwright.plugin_api import RunContext, Segmenter


def segment(component: Component, segmenter: Segmenter, ctx: RunContext) -> tuple[Segment, ...] | Rejection:
    """Segments of the component's prepared mesh, or why the segmenter makes none of it.

    `PluginFailure` where the plug-in returns no partition of the mesh's faces.
    """
    answer = segmenter.segment(component, ctx)
    if isinstance(answer, Rejection):
        return answer
    segments = tuple(answer)
    fault = _partition_fault(segments, len(component.mesh.faces))
    if fault:
        raise PluginFailure(
            f"segmenter {segmenter.key!r} returned no partition: {fault}", plugin=segmenter.key, component=component.id
        )
    return segments


def source_labels(mesh: Mesh, segments: Sequence[Segment], file_face_count: int) -> IntArray:
    """Segment id of each face of the file, (file_face_count,): that of most of its area.

    A face that preparation left out takes the label of the nearest face in the file's order that was kept.
    """
    label_of_face = np.empty(len(mesh.faces), dtype=np.int64)
    for item in segments:
        label_of_face[item.faces] = item.id
    source = np.arange(len(mesh.faces)) if mesh.source_faces is None else mesh.source_faces
    kept, row = np.unique(source, return_inverse=True)
    count = int(label_of_face.max()) + 1
    area = np.maximum(face_areas_mm2(mesh), np.finfo(float).tiny)  # faces without area have a label too
    share = np.bincount(row * count + label_of_face, weights=area, minlength=len(kept) * count)
    labels = share.reshape(len(kept), count).argmax(axis=1)  # (kept,)
    faces = np.arange(file_face_count)
    after = np.searchsorted(kept, faces).clip(max=len(kept) - 1)
    before = (after - 1).clip(min=0)
    nearer = np.where(np.abs(kept[before] - faces) < np.abs(kept[after] - faces), before, after)
    return np.asarray(labels[nearer])


def _partition_fault(segments: tuple[Segment, ...], face_count: int) -> str:
    """What is wrong with segments as a partition of the faces; empty where nothing is."""
    if [item.id for item in segments] != list(range(len(segments))):
        return "ids do not count from 0"
    if any(not item.faces.size for item in segments):
        return "a segment has no faces"
    faces = np.concatenate([item.faces for item in segments]) if segments else np.empty(0, dtype=np.int64)
    if faces.size and (faces.min() < 0 or faces.max() >= face_count):
        return f"a face number lies outside 0 to {face_count - 1}"
    times = np.bincount(faces, minlength=face_count)
    if (times != 1).any():
        return f"{int((times == 0).sum())} of {face_count} faces are in no segment, {int((times > 1).sum())} in several"
    if any((np.diff(item.faces) <= 0).any() for item in segments):
        return "the faces of a segment are not in ascending order"
    return ""
