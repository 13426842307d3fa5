"""PLY, ASCII and binary, with polygons of any number of corners in the file's order."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from gripwright.cad.numerals import count, real
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
_COUNT_TYPES = {name: type_ for name, type_ in _TYPES.items() if not type_.startswith("f")}
_MAX_ELEMENTS = 100
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
        order, elements = _header(head.decode("latin-1"))
        vertices, triangles = np.empty((0, 3)), np.empty((0, 3), dtype=np.int64)
        reader = _Body(body, order)
        for element in elements:
            if element.name == "vertex":
                vertices = reader.positions(element)
            elif element.name == "face":
                triangles = reader.triangles(element)
            else:
                reader.rows(element)
        reader.end()
    except (ValueError, OverflowError) as error:
        raise InvalidGeometry(f"cannot be read as PLY: {error}") from None
    return vertices, triangles


def _header(text: str) -> tuple[str | None, list[_Element]]:
    """Byte order, None for ASCII, and the elements."""
    orders: list[str | None] = []
    elements: list[_Element] = []
    for words in map(str.split, text.splitlines()[1:]):
        match words:
            case ["format", name, *_]:
                orders.append(None if name == "ascii" else _known(name, _BYTE_ORDERS, "format"))
            case ["element", name, number]:
                elements.append(_Element(name, count(number, f"elements {name[:40]!r}")))
            case ["property", *type_, name] if elements and type_:
                elements[-1].properties.append(_property(type_, name))
            case ["element" | "property", *_]:
                raise ValueError(f"its header has a line that is none: {' '.join(words)[:60]!r}")
        if len(elements) > _MAX_ELEMENTS:
            raise ValueError(f"its header has more than {_MAX_ELEMENTS} elements")
    if len(orders) != 1:
        raise ValueError(f"its header names {len(orders)} formats, must be one")
    names = [element.name for element in elements]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ValueError(f"its header has two elements {twice[:40]!r}")
    return orders[0], elements


def _property(type_: list[str], name: str) -> _Property:
    match type_:
        case ["list", number, value]:
            return _Property(name, _known(value, _TYPES, "type"), _known(number, _COUNT_TYPES, "type of a count"))
        case [value]:
            return _Property(name, _known(value, _TYPES, "type"), None)
    raise ValueError(f"its header has a property of {' '.join(type_)[:60]!r}")


def _known(word: str, table: Mapping[str, str], what: str) -> str:
    if word not in table:
        raise ValueError(f"{word[:40]!r} is no {what}")
    return table[word]


class _Body:
    """What follows the header, element by element."""

    def __init__(self, body: bytes, order: str | None) -> None:
        self._body, self._order, self._offset = body, order, 0
        self._lines = [line.split() for line in body.splitlines() if line.strip()] if order is None else []

    def positions(self, element: _Element) -> FloatArray:
        """(n, 3)."""
        names = [property_.name for property_ in element.properties if property_.count_type is None]
        missing = [axis for axis in "xyz" if axis not in names]
        if missing:
            raise ValueError(f"its vertices have no {' and no '.join(missing)}")
        names = [property_.name for property_ in element.properties]
        columns = [names.index(axis) for axis in "xyz"]
        table = self._table(element)
        if table is not None:
            return np.stack([table[names[column]] for column in columns], axis=1).astype(np.float64)
        return np.array([[row[column][0] for column in columns] for row in self.rows(element)]).reshape(-1, 3)

    def triangles(self, element: _Element) -> IntArray:
        """(m, 3), polygons as fans."""
        names = [property_.name for property_ in element.properties]
        columns = [k for k, p in enumerate(element.properties) if p.name in _CORNERS and p.count_type is not None]
        if not columns:
            raise ValueError("its faces have no vertex_indices")
        column = columns[0]
        table = self._table(element)
        if table is not None:
            return _whole(table[names[column]])
        return fans([[_corner(value) for value in row[column]] for row in self.rows(element)])

    def end(self) -> None:
        """ValueError where more follows than padding: then the lengths of its lists are not what they say."""
        left = len(self._lines) - self._offset if self._order is None else len(self._body[self._offset :].strip(b"\0 \r\n"))
        if left:
            raise ValueError(f"{left} {'lines' if self._order is None else 'bytes'} follow its last element")

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
        if element.count and not element.properties:
            raise ValueError(f"its {element.count} elements {element.name[:40]!r} have no properties")
        row = self._ascii_row if self._order is None else self._binary_row
        return [row(element) for _ in range(element.count)]

    def _ascii_row(self, element: _Element) -> Row:
        if self._offset >= len(self._lines):
            raise ValueError(
                f"it ends early: {self._offset} lines after the header, {element.count} {element.name[:40]!r} declared"
            )
        words = self._lines[self._offset]
        self._offset += 1
        values, at = [], 0
        for property_ in element.properties:
            length = 1
            if property_.count_type is not None:
                self._need(words, at + 1)
                length, at = count(words[at].decode("latin-1"), "values of a list"), at + 1
            self._need(words, at + length)
            values.append([real(word.decode("latin-1")) for word in words[at : at + length]])
            at += length
        return values

    def _need(self, words: Sequence[bytes], number: int) -> None:
        if number > len(words):
            raise ValueError(f"line {self._offset} after the header has {len(words)} values, {number} are needed")

    def _binary_row(self, element: _Element) -> Row:
        values = []
        for property_ in element.properties:
            length = 1 if property_.count_type is None else int(self._take(property_.count_type, 1)[0])
            values.append(self._take(property_.type, length).tolist())
        return values

    def _take(self, type_: str, number: int) -> npt.NDArray[np.generic]:
        dtype = np.dtype(f"{self._order}{type_}")
        left = len(self._body) - self._offset
        if number < 0 or number * dtype.itemsize > left:
            raise ValueError(f"it ends early: {number} values of {dtype.itemsize} bytes are needed, {left} bytes are left")
        taken = np.frombuffer(self._body, dtype, number, self._offset)
        self._offset += taken.nbytes
        return taken


def _corner(value: float) -> int:
    if not float(value).is_integer():
        raise ValueError(f"a corner is vertex {value:g}")
    return int(value)


def _whole(corners: npt.NDArray[np.generic]) -> IntArray:
    whole = np.asarray(corners).astype(np.int64)
    if corners.dtype.kind == "f" and not np.array_equal(whole, corners):
        raise ValueError("its corners are no integers")
    return whole
