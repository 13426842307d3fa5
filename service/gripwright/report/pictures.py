"""Pictures without a graphics card: a depth buffer, flat shading, and lines where parts or creases meet."""

import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from PIL import Image

from gripwright.domain.shape import BoolArray, FloatArray, IntArray, Mesh
from gripwright.geometry.measures import face_normals
from gripwright.geometry.raster import first_seen

_SAMPLES = 2  # a pixel, along each axis
_LIGHT = np.array([0.35, 0.25, 0.9]) / np.linalg.norm([0.35, 0.25, 0.9])  # seen from the camera: right, up, towards it
_FAR_MM = 1e6
_BACKGROUND = np.array([1.0, 1.0, 1.0])
_MARK, _RING = np.array([0.85, 0.05, 0.05]), (26.0, 34.0)  # inner and outer radius, samples

Camera = tuple[FloatArray, FloatArray, FloatArray]
"""Unit vectors of a view: right, up, towards the viewer."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shown:
    """A mesh in a picture: its pose in the picture's frame and its colour, or one for each face, 0..1."""

    mesh: Mesh
    X: FloatArray  # (4, 4)
    colours: FloatArray  # (3,) or (m, 3)


def shown(mesh: Mesh, X: FloatArray, colour: Sequence[float] | FloatArray) -> Shown:
    """A mesh in one colour, or with a colour for each face."""
    return Shown(mesh=mesh, X=X, colours=np.asarray(colour, dtype=float))


def picture(
    items: Sequence[Shown],
    *,
    direction: Sequence[float],
    width: int = 480,
    height: int = 360,
    focus: FloatArray | None = None,
    mark: FloatArray | None = None,
) -> bytes:
    """A PNG of the items seen orthographically along `direction` (from the viewer), +z up.

    `focus`: points (n, 3) that fill the picture; everything, where None.
    A red ring is drawn around the point `mark` (3,), whatever stands before it.
    """
    points = np.concatenate([item.mesh.vertices_mm @ item.X[:3, :3].T + item.X[:3, 3] for item in items])
    offsets = np.cumsum([0, *(len(item.mesh.vertices_mm) for item in items)])
    faces = np.concatenate([item.mesh.faces + offset for item, offset in zip(items, offsets, strict=False)])
    camera = _camera(np.asarray(direction, dtype=float))
    shape = (height * _SAMPLES, width * _SAMPLES)
    frame = _Frame(points if focus is None else focus, camera, shape)
    face, depth = first_seen(frame.seen(points)[faces], *shape)
    looks = _looks(items, Mesh(vertices_mm=points, faces=faces), camera)
    lines = _lines(looks.kind[face], looks.normal[face], np.minimum(depth, _FAR_MM).astype(np.float32), frame.sample_mm)
    image = looks.colour[face]
    image[lines] *= 0.45
    if mark is not None:
        image[frame.ring(mark)] = _MARK
    return _png(_averaged(image))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Looks:
    """How each face looks; the last row stands for the background, so that index −1 finds it."""

    colour: npt.NDArray[np.float32]  # (m + 1, 3) shaded
    normal: npt.NDArray[np.float32]  # (m + 1, 3) towards the viewer
    kind: IntArray  # (m + 1,) part and colour


def _looks(items: Sequence[Shown], mesh: Mesh, camera: Camera) -> _Looks:
    colours = np.concatenate([np.broadcast_to(item.colours, (len(item.mesh.faces), 3)) for item in items])
    part = np.repeat(np.arange(len(items)), [len(item.mesh.faces) for item in items])
    normals = face_normals(mesh)
    normals *= np.where(normals @ camera[2] < 0.0, -1.0, 1.0)[:, None]
    light = 0.35 + 0.65 * np.clip(normals @ (_LIGHT @ np.array(camera)), 0.0, 1.0)
    kind = part * 2**24 + (np.round(colours * 255.0).astype(np.int64) @ [65536, 256, 1])
    return _Looks(
        colour=np.vstack([colours * light[:, None], _BACKGROUND]).astype(np.float32),
        normal=np.vstack([normals, np.zeros(3)]).astype(np.float32),
        kind=np.append(kind, -1),
    )


def _camera(direction: FloatArray) -> Camera:
    towards = -direction / np.linalg.norm(direction)
    up = np.array([0.0, 0.0, 1.0]) if abs(towards[2]) < 0.99 else np.array([0.0, 1.0, 0.0])
    right = np.cross(up, towards)
    right /= np.linalg.norm(right)
    return right, np.cross(towards, right), towards


class _Frame:
    """The samples of an orthographic picture that shows `focus`."""

    def __init__(self, focus: FloatArray, camera: Camera, shape: tuple[int, int]) -> None:
        rows, columns = self._shape = shape
        self._camera = camera
        u, v = focus @ camera[0], focus @ camera[1]
        self.sample_mm = float(max(np.ptp(u) / (0.94 * columns), np.ptp(v) / (0.94 * rows), 1e-6))
        self._middle = np.array([(u.min() + u.max()) / 2.0, (v.min() + v.max()) / 2.0])  # mm, right and up

    def seen(self, points: FloatArray) -> FloatArray:
        """Column, row and depth (mm, from the plane of the frame's origin) of points (n, 3)."""
        rows, columns = self._shape
        right, up, towards = (points @ axis for axis in self._camera)
        across = (right - self._middle[0]) / self.sample_mm + (columns - 1) / 2.0
        down = (self._middle[1] - up) / self.sample_mm + (rows - 1) / 2.0
        return np.stack([across, down, -towards], axis=-1)

    def ring(self, point: FloatArray) -> BoolArray:
        """The samples of a ring around a point, (rows, columns)."""
        column, row, _ = self.seen(point)
        rows, columns = np.ogrid[: self._shape[0], : self._shape[1]]
        radius = np.hypot(columns - column, rows - row)
        return np.asarray((radius >= _RING[0]) & (radius <= _RING[1]))


def _lines(kind: IntArray, normal: npt.NDArray[np.float32], depth: npt.NDArray[np.float32], sample_mm: float) -> BoolArray:
    """Samples beside an outline, a border of colour or a crease of more than 30°."""
    result = np.zeros(kind.shape, dtype=bool)
    for axis in (0, 1):
        a = tuple(slice(None, -1) if k == axis else slice(None) for k in range(2))
        b = tuple(slice(1, None) if k == axis else slice(None) for k in range(2))
        step = kind[a] != kind[b]
        step |= np.einsum("ijk,ijk->ij", normal[a], normal[b]) < np.cos(np.radians(30.0))
        step |= np.abs(depth[a] - depth[b]) > 12.0 * sample_mm
        result[a] |= step & ((kind[a] >= 0) | (kind[b] >= 0))
    return result


def _averaged(image: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """One pixel for `_SAMPLES` by `_SAMPLES` samples: sums of slices, much faster than a mean over short axes."""
    total = np.zeros_like(image[::_SAMPLES, ::_SAMPLES])
    for i, j in np.ndindex(_SAMPLES, _SAMPLES):
        total += image[i::_SAMPLES, j::_SAMPLES]
    return total / np.float32(_SAMPLES**2)


def _png(image: npt.NDArray[np.float32]) -> bytes:
    stream = io.BytesIO()
    srgb = np.clip(image, 0.0, 1.0) * 255.0
    Image.fromarray(srgb.astype(np.uint8)).quantize(128, dither=Image.Dither.NONE).save(stream, format="PNG", optimize=True)
    return stream.getvalue()
