"""Binary glTF 2.0 files (.glb), read: every triangle of the scene. What cannot be read whole is refused, never filled up."""

import base64
import binascii
import struct
from collections.abc import Sequence
from typing import Annotated, Any, Literal

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, Field, ValidationError

from gripwright.cad.document import parse_json
from gripwright.cad.limits import Limits
from gripwright.cad.placed import Placements
from gripwright.cad.polygons import Polygons
from gripwright.domain.errors import InvalidGeometry, InvalidInput, LimitExceeded
from gripwright.domain.shape import FloatArray, IntArray

_JSON, _BINARY = 0x4E4F534A, 0x004E4942
_HEAD, _CHUNK = struct.Struct("<4sII"), struct.Struct("<II")
_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_POINTS, _STRIP, _FAN = (0, 1, 2, 3), 5, 6
_HARMLESS = ("KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_", "KHR_mesh_quantization", "KHR_xmp")
_UNIT_TOLERANCE = 1e-2  # of a quaternion's length from 1: exporters round

Natural = Annotated[int, Field(strict=True, ge=0, lt=2**53)]
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]


class _Asset(BaseModel):
    version: str


class _Buffer(BaseModel):
    uri: str | None = None
    byteLength: Annotated[Natural, Field(ge=1)]


class _View(BaseModel):
    buffer: Natural
    byteOffset: Natural = 0
    byteLength: Annotated[Natural, Field(ge=1)]
    byteStride: Annotated[int, Field(strict=True, ge=4, le=252)] | None = None


class _Accessor(BaseModel):
    bufferView: Natural | None = None
    byteOffset: Natural = 0
    componentType: Literal[5120, 5121, 5122, 5123, 5125, 5126]
    count: Annotated[Natural, Field(ge=1)]
    type: Literal["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"]
    normalized: bool = False
    sparse: Any = None


class _Primitive(BaseModel):
    attributes: dict[str, Natural]
    indices: Natural | None = None
    mode: Annotated[int, Field(strict=True, ge=0, le=6)] = 4


class _Mesh(BaseModel):
    primitives: Annotated[list[_Primitive], Field(min_length=1)]


class _Node(BaseModel):
    mesh: Natural | None = None
    children: list[Natural] = []
    matrix: Annotated[list[Number], Field(min_length=16, max_length=16)] | None = None
    translation: tuple[Number, Number, Number] = (0.0, 0.0, 0.0)
    rotation: tuple[Number, Number, Number, Number] = (0.0, 0.0, 0.0, 1.0)
    scale: tuple[Number, Number, Number] = (1.0, 1.0, 1.0)


class _Scene(BaseModel):
    nodes: list[Natural] = []


class _Document(BaseModel):
    asset: _Asset
    extensionsRequired: list[str] = []
    scene: Natural = 0
    scenes: list[_Scene] = []
    nodes: list[_Node] = []
    meshes: list[_Mesh] = []
    accessors: list[_Accessor] = []
    bufferViews: list[_View] = []
    buffers: list[_Buffer] = []


def read_glb(data: bytes, limits: Limits) -> Polygons:
    """Vertices and triangles of the file's scene in its own frame and unit."""
    text, binary = _chunks(data)
    document = _document(text, limits)
    scene = _Scene(nodes=_roots(document))
    if document.scenes:
        scene = _entry(document.scenes, document.scene, "scene")
    placements, arrays = Placements(limits), _Arrays(document, binary, limits)
    seen: set[int] = set()
    waiting = [(number, np.eye(4), 1) for number in reversed(scene.nodes)]
    while waiting:
        number, X, depth = waiting.pop()
        node = _entry(document.nodes, number, "node")
        placements.visit(depth)
        if number in seen:
            raise InvalidGeometry(f"cannot be read as glTF: its nodes are no tree, number {number} is reached twice")
        seen.add(number)
        X = X @ _pose(node, number)
        if node.mesh is not None:
            for mesh in arrays.mesh(node.mesh):
                placements.add(X, mesh)
        waiting += [(child, X, depth + 1) for child in reversed(node.children)]
    return placements.polygons()


def _chunks(data: bytes) -> tuple[bytes, bytes]:
    """The JSON and the binary chunk."""
    if len(data) < _HEAD.size:
        raise InvalidGeometry(f"ends early: {len(data)} bytes are no glTF")
    magic, version, length = _HEAD.unpack_from(data)
    if magic != b"glTF" or version != 2:
        raise InvalidGeometry("cannot be read: it is no binary glTF 2.0")
    if length != len(data):
        raise InvalidGeometry(f"declares {length} bytes, and holds {len(data)}")
    chunks: dict[int, bytes] = {}
    offset = _HEAD.size
    while offset < length:
        if length - offset < _CHUNK.size:
            raise InvalidGeometry("ends early: a chunk has no whole head")
        size, kind = _CHUNK.unpack_from(data, offset)
        offset += _CHUNK.size
        if size > length - offset:
            raise InvalidGeometry(f"ends early: a chunk declares {size} bytes, {length - offset} are left")
        chunks.setdefault(kind, data[offset : offset + size])
        offset += size
    if _JSON not in chunks:
        raise InvalidGeometry("cannot be read: it has no JSON chunk")
    return chunks[_JSON], chunks.get(_BINARY, b"")


def _document(text: bytes, limits: Limits) -> _Document:
    try:
        document = _Document.model_validate(parse_json(text, "its JSON", limits.max_document_bytes))
    except LimitExceeded:
        raise
    except InvalidInput as error:
        raise InvalidGeometry(f"cannot be read as glTF: {error.detail}") from None
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False, include_context=False)[0]
        place = "/".join(map(str, first["loc"])) or "its JSON"
        raise InvalidGeometry(f"cannot be read as glTF: {place}: {first['msg'].lower()}") from None
    if document.asset.version.partition(".")[0] != "2":
        raise InvalidGeometry(f"is glTF of version {document.asset.version[:20]!r}, not 2")
    unknown = [name for name in document.extensionsRequired if not name.startswith(_HARMLESS)]
    if unknown:
        raise InvalidGeometry(f"requires the glTF extension {unknown[0][:80]!r}, which is not read")
    return document


def _roots(document: _Document) -> list[int]:
    """The nodes that no other node holds: all there is where the file has no scene."""
    children = {child for node in document.nodes for child in node.children}
    return [number for number in range(len(document.nodes)) if number not in children]


def _entry(entries: Sequence[Any], number: int, what: str) -> Any:
    if number >= len(entries):
        raise InvalidGeometry(f"cannot be read as glTF: it refers to {what} {number}, and has {len(entries)}")
    return entries[number]


def _pose(node: _Node, number: int) -> FloatArray:
    """The node's own transformation (4, 4)."""
    if node.matrix is not None:
        return np.array(node.matrix).reshape(4, 4).T
    x, y, z, w = node.rotation
    length = float(np.sqrt(x * x + y * y + z * z + w * w))
    if abs(length - 1) > _UNIT_TOLERANCE:
        raise InvalidGeometry(f"cannot be read as glTF: the rotation of node {number} has the length {length:.3g}, not 1")
    x, y, z, w = x / length, y / length, z / length, w / length
    R = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    X = np.eye(4)
    X[:3, :3] = R * np.array(node.scale)
    X[:3, 3] = node.translation
    return X


class _Arrays:
    """Meshes by number, each read once; nothing is read outside of its buffer."""

    def __init__(self, document: _Document, binary: bytes, limits: Limits) -> None:
        self._document, self._binary, self._limits = document, binary, limits
        self._buffers: dict[int, bytes] = {}
        self._meshes: dict[int, list[Polygons]] = {}

    def mesh(self, number: int) -> list[Polygons]:
        """The triangles of each primitive that has any."""
        if number not in self._meshes:
            mesh = _entry(self._document.meshes, number, "mesh")
            self._meshes[number] = [self._primitive(primitive) for primitive in mesh.primitives if primitive.mode not in _POINTS]
        return self._meshes[number]

    def _primitive(self, primitive: _Primitive) -> Polygons:
        if "POSITION" not in primitive.attributes:
            raise InvalidGeometry("cannot be read as glTF: it has triangles without positions")
        vertices = self._read(primitive.attributes["POSITION"], "VEC3", (5120, 5121, 5122, 5123, 5126)).astype(np.float64)
        if primitive.indices is None:
            corners = np.arange(len(vertices), dtype=np.int64)
        else:
            corners = self._read(primitive.indices, "SCALAR", (5121, 5123, 5125)).reshape(-1).astype(np.int64)
        if len(corners) and corners.max() >= len(vertices):
            raise InvalidGeometry(f"cannot be read as glTF: a corner is vertex {corners.max()} of {len(vertices)}")
        return vertices, _triangles(corners, primitive.mode)

    def _read(self, number: int, type: str, component_types: Sequence[int]) -> npt.NDArray[Any]:
        """The values of an accessor (count, width)."""
        accessor: _Accessor = _entry(self._document.accessors, number, "accessor")
        problem = None
        if accessor.type != type or accessor.componentType not in component_types:
            problem = f"is {accessor.type} of {accessor.componentType}, which is not what it is used for"
        elif accessor.sparse is not None:
            problem = "is sparse, which is not read"
        elif accessor.bufferView is None:
            problem = "has no bufferView"
        if problem is not None or accessor.bufferView is None:
            raise InvalidGeometry(f"cannot be read as glTF: accessor {number} {problem}")
        view: _View = _entry(self._document.bufferViews, accessor.bufferView, "bufferView")
        buffer = self._buffer(view.buffer)
        dtype, width = np.dtype(_TYPES[accessor.componentType]), _WIDTHS[type]
        size = dtype.itemsize * width
        stride = view.byteStride or size
        end = accessor.byteOffset + stride * (accessor.count - 1) + size
        if stride < size or end > view.byteLength or view.byteOffset + view.byteLength > len(buffer):
            raise InvalidGeometry(
                f"cannot be read as glTF: accessor {number} needs {end} bytes, its bufferView has {view.byteLength} "
                f"from {view.byteOffset} on in a buffer of {len(buffer)}"
            )
        values: npt.NDArray[Any] = np.ndarray(
            (accessor.count, width), dtype, buffer, view.byteOffset + accessor.byteOffset, (stride, dtype.itemsize)
        )
        if accessor.normalized and dtype.kind != "f":
            return np.maximum(values / np.iinfo(dtype).max, -1.0)
        return values

    def _buffer(self, number: int) -> bytes:
        if number not in self._buffers:
            buffer: _Buffer = _entry(self._document.buffers, number, "buffer")
            data = self._binary if number == 0 and buffer.uri is None else _embedded(buffer.uri, number)
            if buffer.byteLength > len(data):
                raise InvalidGeometry(f"ends early: buffer {number} declares {buffer.byteLength} bytes, and holds {len(data)}")
            self._buffers[number] = data[: buffer.byteLength]
        return self._buffers[number]


def _embedded(uri: str | None, number: int) -> bytes:
    head, comma, text = (uri or "").partition(",")
    if not head.startswith("data:") or not head.endswith(";base64") or not comma:
        raise InvalidGeometry(f"keeps buffer {number} in another file, which is not read")
    try:
        return base64.b64decode(text, validate=True)
    except (binascii.Error, ValueError):
        raise InvalidGeometry(f"cannot be read as glTF: buffer {number} is no base64") from None


def _triangles(corners: IntArray, mode: int) -> IntArray:
    """Triangles (m, 3) of a list, a strip or a fan of corners."""
    if mode in (_STRIP, _FAN):
        count = max(len(corners) - 2, 0)
        k = np.arange(count)
        if mode == _FAN:
            return np.stack([np.full(count, corners[0]), corners[k + 1], corners[k + 2]], axis=1)
        return np.stack([corners[k], corners[k + 1 + k % 2], corners[k + 2 - k % 2]], axis=1)
    if len(corners) % 3:
        raise InvalidGeometry(f"cannot be read as glTF: {len(corners)} corners are no whole number of triangles")
    return corners.reshape(-1, 3)
