"""PLY, ASCII and binary, with polygons of any number of corners in the file's order."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from gripwright.cad.polygons import Polygons, fans
from gripwright.domain.errors import InvalidGeometry
from gripwright.domain.shape import FloatArray, IntArray

_TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4", "double": "f8"},
    **{
        "int8": "i1",
        "uint8": "u1",
        "int16": "i2",
        "uint16": "u2",
        "int32": "i4",
        "uint32": "u4",
        "float32": "f4",
        "float64": "f8",
    },
}
_BYTE_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}
_CORNERS = frozenset({"vertex_indices", "vertex_index"})


@dataclass(frozen=True, slots=True)
class _Property:
    name: str
    type: str
    count_type: str | None  # None: one value, else a list


@dataclass(frozen=True, slots=True)
class _Element:
    name: str
    count: int
    properties: list[_Property] = field(default_factory=list)


Row = Sequence[Sequence[float]]  # the values of each property


def read_ply(data: bytes) -> Polygons:
    """Vertices and triangles; other elements and properties are skipped."""
    head, end, body = data.partition(b"end_header")
    if not data.startswith(b"ply") or not end:
        raise InvalidGeometry("cannot be read: it has no PLY header")
    body = body[2:] if body.startswith(b"\r\n") else body[1:]
    try:
        order, elements = _header(head.decode("ascii"))
        vertices, triangles = np.empty((0, 3)), np.empty((0, 3), dtype=np.int64)
        reader = _Body(body, order)
        for element in elements:
            if element.name == "vertex":
                vertices = reader.positions(element)
            elif element.name == "face":
                triangles = reader.triangles(element)
            else:
                reader.rows(element)
    except (ValueError, KeyError, IndexError, OverflowError) as error:
        raise InvalidGeometry(f"cannot be read as PLY: {error}") from None
    return vertices, triangles


def _header(text: str) -> tuple[str | None, list[_Element]]:
    """Byte order, None for ASCII, and the elements."""
    order: str | None = None
    elements: list[_Element] = []
    for words in map(str.split, text.splitlines()[1:]):
        match words:
            case ["format", name, *_]:
                order = None if name == "ascii" else _BYTE_ORDERS[name]
            case ["element", name, count]:
                elements.append(_Element(name, int(count)))
            case ["property", "list", count_type, type_, name]:
                elements[-1].properties.append(_Property(name, _TYPES[type_], _TYPES[count_type]))
            case ["property", type_, name]:
                elements[-1].properties.append(_Property(name, _TYPES[type_], None))
    return order, elements


class _Body:
    """What follows the header, element by element."""

    def __init__(self, body: bytes, order: str | None) -> None:
        self._body, self._order, self._offset = body, order, 0
        self._lines = [line.split() for line in body.splitlines() if line.strip()] if order is None else []

    def positions(self, element: _Element) -> FloatArray:
        """(n, 3)."""
        names = [property_.name for property_ in element.properties]
        columns = [names.index(axis) for axis in "xyz"]
        table = self._table(element)
        if table is not None:
            return np.stack([table[names[column]] for column in columns], axis=1).astype(np.float64)
        return np.array([[row[column][0] for column in columns] for row in self.rows(element)]).reshape(-1, 3)

    def triangles(self, element: _Element) -> IntArray:
        """(m, 3), polygons as fans."""
        names = [property_.name for property_ in element.properties]
        columns = [k for k, name in enumerate(names) if name in _CORNERS]
        if not columns:
            raise ValueError("its faces have no vertex_indices")
        column = columns[0]
        table = self._table(element)
        if table is not None:
            return np.asarray(table[names[column]], dtype=np.int64)
        return fans([[int(corner) for corner in row[column]] for row in self.rows(element)])

    def _table(self, element: _Element) -> npt.NDArray[np.void] | None:
        """All rows at once where the file is binary and every list holds three values, else None."""
        if self._order is None or not element.count:
            return None
        fields: list[tuple[str, str, tuple[int, ...]]] = []
        for property_ in element.properties:
            if property_.count_type is not None:
                fields.append((f"#{property_.name}", self._order + property_.count_type, ()))
            fields.append((property_.name, self._order + property_.type, () if property_.count_type is None else (3,)))
        dtype = np.dtype(fields)
        if self._offset + element.count * dtype.itemsize > len(self._body):
            return None
        table = np.frombuffer(self._body, dtype, element.count, self._offset)
        if any((table[name] != 3).any() for name, _, _ in fields if name.startswith("#")):
            return None
        self._offset += table.nbytes
        return table

    def rows(self, element: _Element) -> list[Row]:
        """Row by row, whatever the lengths of lists are."""
        row = self._ascii_row if self._order is None else self._binary_row
        return [row(element) for _ in range(element.count)]

    def _ascii_row(self, element: _Element) -> Row:
        words = self._lines[self._offset]
        self._offset += 1
        values, at = [], 0
        for property_ in element.properties:
            count = 1
            if property_.count_type is not None:
                count, at = int(words[at]), at + 1
            values.append([float(word) for word in words[at : at + count]])
            at += count
        if at > len(words):
            raise ValueError(f"line {self._offset} after the header has {len(words)} values, {at} are needed")
        return values

    def _binary_row(self, element: _Element) -> Row:
        values = []
        for property_ in element.properties:
            count = 1 if property_.count_type is None else int(self._take(property_.count_type, 1)[0])
            values.append(self._take(property_.type, count).tolist())
        return values

    def _take(self, type_: str, count: int) -> npt.NDArray[np.generic]:
        if count < 0:
            raise ValueError(f"a list of {count} values")
        taken = np.frombuffer(self._body, f"{self._order}{type_}", count, self._offset)
        self._offset += taken.nbytes
        return taken
