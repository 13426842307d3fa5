"""Binary glTF 2.0 files (.glb), written without a mesh library; the same input gives the same bytes.

glTF lengths are metres, ours mm: vertices and translations are divided by 1000. glTF also says that +y is up; our frames,
+z up, are written as they are, and the page that shows them turns its camera.
"""

import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from gripwright.domain.assembly import IDENTITY
from gripwright.domain.shape import FloatArray, Mesh

M_PER_MM = 1e-3
Colour = tuple[float, float, float]  # linear red, green, blue, 0..1
GREY: Colour = (0.6, 0.6, 0.62)
_FLOAT, _UNSIGNED = 5126, 5125
_VERTICES, _INDICES = 34962, 34963


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GlbPart:
    """One node: a mesh in its own frame, placed by `X` (4, 4) in mm. `face_colours` (m, 3) outrank `colour`."""

    name: str
    mesh: Mesh
    colour: Colour = GREY
    X: FloatArray = field(default_factory=lambda: IDENTITY)
    face_colours: FloatArray | None = None


class _Buffer:
    """The binary chunk and what describes it."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, int]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, array: npt.NDArray[Any], component_type: int, shape: str, target: int, *, bounds: bool) -> int:
        """Append an array; its accessor's number. Every type here is 4 bytes wide, so alignment follows."""
        raw = array.tobytes()
        self.views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(raw), "target": target})
        accessor = {"bufferView": len(self.views) - 1, "componentType": component_type, "count": len(array), "type": shape}
        if bounds:
            accessor |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
        self.accessors.append(accessor)
        self.data += raw
        return len(self.accessors) - 1


def glb_bytes(parts: Sequence[GlbPart]) -> bytes:
    """A scene of one node a part. Normals are left out: viewers then shade flat, face by face, as glTF demands."""
    buffer = _Buffer()
    nodes: list[dict[str, Any]] = []
    meshes: list[dict[str, Any]] = []
    materials: list[dict[str, Any]] = []
    for part in parts:
        positions, indices, colours = _arrays(part)
        attributes = {"POSITION": buffer.add(positions, _FLOAT, "VEC3", _VERTICES, bounds=True)}
        if colours is not None:
            attributes["COLOR_0"] = buffer.add(colours, _FLOAT, "VEC3", _VERTICES, bounds=False)
        primitive = {
            "attributes": attributes,
            "indices": buffer.add(indices, _UNSIGNED, "SCALAR", _INDICES, bounds=False),
            "material": len(materials),
        }
        base = (1.0, 1.0, 1.0) if colours is not None else part.colour
        materials.append(
            {
                "name": part.name,
                "pbrMetallicRoughness": {"baseColorFactor": [*base, 1.0], "metallicFactor": 0.1, "roughnessFactor": 0.7},
                "doubleSided": True,
            }
        )
        nodes.append({"name": part.name, "mesh": len(meshes), "matrix": _matrix(part.X)})
        meshes.append({"name": part.name, "primitives": [primitive]})
    document = {
        "asset": {"version": "2.0", "generator": "gripwright"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": materials,
        "buffers": [{"byteLength": len(buffer.data)}],
        "bufferViews": buffer.views,
        "accessors": buffer.accessors,
    }
    return _container(json.dumps(document, separators=(",", ":")).encode(), bytes(buffer.data))


def _arrays(part: GlbPart) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.uint32], npt.NDArray[np.float32] | None]:
    """Positions (n, 3) in m, indices (3m,), colours (n, 3); only faces of one colour share vertices."""
    if part.face_colours is None:
        positions, indices, colours = part.mesh.vertices_mm, part.mesh.faces.reshape(-1), None
    else:
        palette, colour = np.unique(part.face_colours, axis=0, return_inverse=True)
        corners = part.mesh.faces.reshape(-1) * len(palette) + np.repeat(colour.reshape(-1), 3)  # a vertex in a colour
        distinct, indices = np.unique(corners, return_inverse=True)
        positions = part.mesh.vertices_mm[distinct // len(palette)]
        colours = palette[distinct % len(palette)].astype("<f4")
    return (positions * M_PER_MM).astype("<f4"), indices.astype("<u4"), colours


def _matrix(X: FloatArray) -> list[float]:
    """The pose in metres, column by column."""
    scaled = X.copy()
    scaled[:3, 3] *= M_PER_MM
    return [float(value) for value in scaled.T.reshape(-1)]


def _container(document: bytes, binary: bytes) -> bytes:
    document += b" " * (-len(document) % 4)
    chunks = [struct.pack("<II", len(document), 0x4E4F534A), document]
    if binary:
        chunks += [struct.pack("<II", len(binary), 0x004E4942), binary]
    body = b"".join(chunks)
    return struct.pack("<III", 0x46546C67, 2, 12 + len(body)) + body
