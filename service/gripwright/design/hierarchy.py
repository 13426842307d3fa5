"""Coarser segmentations of a component: its segments joined one by one, down to one for each connected body."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gripwright.domain.shape import IntArray, Mesh, Segment
from gripwright.geometry.adjacency import edge_lengths_mm, exterior_angles_rad, face_adjacency
from gripwright.geometry.measures import face_cross_mm2


@dataclass(frozen=True, slots=True, kw_only=True)
class Join:
    """A segment of a coarser segmentation, made of two of the next finer one."""

    id: int  # after those of the segments and of earlier joins
    children: tuple[int, int]
    area_mm2: float
    border_mm: float  # length of the border that is given up


def joins(mesh: Mesh, segments: Sequence[Segment]) -> tuple[Join, ...]:
    """The joins in their order: after the first n of them the component has n segments fewer.

    The smallest segment joins the neighbour that it continues: the one with the longest common border, of which a sharp
    edge counts less than a smooth one. Segmentations are nested, and a body that touches no other stays alone.
    """
    areas = {item.id: item.area_mm2 for item in segments}
    borders = _borders(mesh, segments)
    done: list[Join] = []
    while any(borders[part] for part in borders):
        small = min((part for part in borders if borders[part]), key=lambda part: (areas[part], part))
        other = max(borders[small], key=lambda part: (borders[small][part][0], -part))
        made = len(segments) + len(done)
        done.append(
            Join(
                id=made,
                children=(min(small, other), max(small, other)),
                area_mm2=areas[small] + areas[other],
                border_mm=borders[small][other][1],
            )
        )
        areas[made] = done[-1].area_mm2
        _merge(borders, small, other, made)
    return tuple(done)


_Borders = dict[int, dict[int, tuple[float, float]]]
"""Part → neighbour → weighted and true length of their border, mm."""


def _borders(mesh: Mesh, segments: Sequence[Segment]) -> _Borders:
    label: IntArray = np.empty(len(mesh.faces), dtype=np.int64)
    for item in segments:
        label[item.faces] = item.id
    adjacency = face_adjacency(mesh)
    lengths = edge_lengths_mm(mesh, adjacency)
    weights = lengths * (1.0 + np.cos(exterior_angles_rad(mesh, adjacency, face_cross_mm2(mesh)))) / 2.0
    ends = np.sort(label[adjacency.pairs], axis=1)
    apart = ends[:, 0] != ends[:, 1]
    pairs, inverse = np.unique(ends[apart], axis=0, return_inverse=True)
    weighted, true = (np.bincount(inverse.ravel(), values[apart], len(pairs)) for values in (weights, lengths))
    borders: _Borders = {item.id: {} for item in segments}
    for (p, q), weight, length in zip(pairs.tolist(), weighted.tolist(), true.tolist(), strict=True):
        borders[p][q] = borders[q][p] = (weight, length)
    return borders


def _merge(borders: _Borders, first: int, second: int, made: int) -> None:
    """Put one part in place of two."""
    joined: dict[int, tuple[float, float]] = {}
    for part in (first, second):
        for neighbour, (weight, length) in borders.pop(part).items():
            if neighbour not in (first, second):
                known = joined.get(neighbour, (0.0, 0.0))
                joined[neighbour] = (known[0] + weight, known[1] + length)
                del borders[neighbour][part]
    borders[made] = joined
    for neighbour, border in joined.items():
        borders[neighbour][made] = border
