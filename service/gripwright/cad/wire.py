"""What passes between the service and the process that parses CAD: a JSON header and raw arrays. Nothing is unpickled."""

import json
import struct
from collections.abc import Sequence
from typing import Any, BinaryIO

import numpy as np

from gripwright.domain.shape import Mesh

_LENGTHS = struct.Struct("<QQ")  # bytes of the header, bytes of the payload


class Closed(EOFError):
    """The other side ended before a whole message had come."""


def send(stream: BinaryIO, header: dict[str, Any], payload: Sequence[bytes] = ()) -> None:
    """Write one message."""
    text = json.dumps(header).encode()
    stream.write(_LENGTHS.pack(len(text), sum(map(len, payload))))
    stream.write(text)
    for part in payload:
        stream.write(part)
    stream.flush()


def receive(stream: BinaryIO) -> tuple[dict[str, Any], bytes]:
    """Read one message: header and payload; Closed where there is none."""
    header_bytes, payload_bytes = _LENGTHS.unpack(_exactly(stream, _LENGTHS.size))
    header: dict[str, Any] = json.loads(_exactly(stream, header_bytes))
    return header, _exactly(stream, payload_bytes)


def _exactly(stream: BinaryIO, count: int) -> bytes:
    data = stream.read(count)
    if len(data) < count:
        raise Closed
    return data


def pack(meshes: Sequence[Mesh]) -> tuple[list[list[int]], list[bytes]]:
    """Sizes [vertices, faces, numbers of CAD faces] and the arrays of meshes as bytes, little-endian float64 and int64."""
    sizes, parts = [], []
    for mesh in meshes:
        numbers = np.empty(0) if mesh.cad_faces is None else mesh.cad_faces
        sizes.append([len(mesh.vertices_mm), len(mesh.faces), len(numbers)])
        parts += [mesh.vertices_mm.astype("<f8").tobytes(), mesh.faces.astype("<i8").tobytes(), numbers.astype("<i8").tobytes()]
    return sizes, parts


def unpack(sizes: Sequence[Sequence[int]], payload: bytes) -> list[Mesh]:
    """The meshes of `pack`."""
    meshes, offset = [], 0
    for vertex_count, face_count, number_count in sizes:
        vertices = np.frombuffer(payload, "<f8", 3 * vertex_count, offset).reshape(-1, 3)
        offset += vertices.nbytes
        faces = np.frombuffer(payload, "<i8", 3 * face_count, offset).reshape(-1, 3)
        offset += faces.nbytes
        numbers = np.frombuffer(payload, "<i8", number_count, offset)
        offset += numbers.nbytes
        meshes.append(
            Mesh(
                vertices_mm=vertices.astype(np.float64),
                faces=faces.astype(np.int64),
                cad_faces=numbers.astype(np.int64) if number_count else None,
            )
        )
    return meshes
