"""3MF: the triangles of what its build places. Document types, hence entities, are refused unread."""

import xml.parsers.expat
from array import array
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from gripwright.cad.archive import ArchiveFiles, open_archive
from gripwright.cad.limits import Limits
from gripwright.cad.numerals import index, real
from gripwright.cad.placed import Placements
from gripwright.cad.polygons import Polygons
from gripwright.domain.errors import InvalidGeometry, LimitExceeded
from gripwright.domain.shape import FloatArray

_UNITS = {"millimeter": "mm", "centimeter": "cm", "meter": "m", "inch": "in", "foot": "ft", "micron": "micron"}
_MODEL = "3d/3dmodel.model"
_Attributes = dict[str, str]


@dataclass(frozen=True, slots=True)
class _Use:
    """An object where it stands: in which model file, which one, and how it is placed."""

    file: str
    id: str
    X: FloatArray


@dataclass(slots=True)
class _Object:
    """A mesh, or other objects."""

    vertices: "array[float]" = field(default_factory=lambda: array("d"))
    corners: "array[int]" = field(default_factory=lambda: array("q"))
    uses: list[_Use] = field(default_factory=list)
    polygons: Polygons | None = None


@dataclass(slots=True)
class _Model:
    """A model file: its unit, its objects and what it builds."""

    unit: str = "mm"
    objects: dict[str, _Object] = field(default_factory=dict)
    build: list[_Use] = field(default_factory=list)


def read_3mf(data: bytes, limits: Limits) -> tuple[Polygons, str]:
    """Vertices and triangles of everything that is built, and the unit."""
    archive = open_archive(data, "its archive", limits)
    root = next((name for name in sorted(archive.names) if name.lower().endswith(_MODEL)), None)
    if root is None:
        raise InvalidGeometry("cannot be read: its archive holds no 3D/3dmodel.model")
    package = _Package(archive, limits)
    placements = Placements(limits)
    model = package.model(root)
    for use in model.build:
        package.place(use, np.eye(4), (), placements)
    return placements.polygons(), model.unit


class _Package:
    """The model files of an archive, each read when it is first asked for."""

    def __init__(self, archive: ArchiveFiles, limits: Limits) -> None:
        self._archive, self._limits = archive, limits
        self._models: dict[str, _Model] = {}

    def model(self, file: str) -> _Model:
        """The content of a model file."""
        if file not in self._models:
            if file not in self._archive.names:
                raise InvalidGeometry(f"cannot be read as 3MF: it refers to {file[:200]!r}, which its archive does not hold")
            self._models[file] = _Reading(file, self._limits).read(self._archive.read(file))
        return self._models[file]

    def place(self, use: _Use, X: FloatArray, above: tuple[tuple[str, str], ...], placements: Placements) -> None:
        """Place an object and all that it is made of; `above` are the objects that it is a part of."""
        placements.visit(len(above) + 1)
        name = (use.file, use.id)
        if name in above:
            raise InvalidGeometry(f"cannot be read as 3MF: object {use.id[:40]!r} is a component of itself")
        found = self.model(use.file).objects.get(use.id)
        if found is None:
            raise InvalidGeometry(f"cannot be read as 3MF: it refers to object {use.id[:40]!r}, which it does not hold")
        X = X @ use.X
        if found.corners:
            found.polygons = found.polygons or _polygons(found)
            placements.add(X, found.polygons)
        for part in found.uses:
            self.place(part, X, (*above, name), placements)


def _polygons(found: _Object) -> Polygons:
    vertices = np.frombuffer(found.vertices, dtype=np.float64).reshape(-1, 3)
    triangles = np.frombuffer(found.corners, dtype=np.int64).reshape(-1, 3)
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise InvalidGeometry(f"holds triangles of vertices that it does not have (it has {len(vertices)})")
    return vertices, triangles


class _Reading:
    """One pass over a model file, element by element: a file of millions of triangles never becomes a tree."""

    def __init__(self, file: str, limits: Limits) -> None:
        self._file, self._limits = file, limits
        self._model, self._object, self._depth = _Model(), _Object(), 0
        self._found_model = False
        self._elements: dict[str, Callable[[_Attributes], None]] = {
            "model": self._on_model,
            "object": self._on_object,
            "vertex": self._on_vertex,
            "triangle": self._on_triangle,
            "component": self._on_component,
            "item": self._on_item,
        }

    def read(self, data: bytes) -> _Model:
        """The content of the file."""
        parser = xml.parsers.expat.ParserCreate(namespace_separator=" ")
        parser.buffer_text = True
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.StartDoctypeDeclHandler = _refuse_document_type
        try:
            parser.Parse(data, True)
        except xml.parsers.expat.ExpatError as error:
            raise InvalidGeometry(f"cannot be read as 3MF: {error}") from None
        except KeyError as error:
            raise InvalidGeometry(f"cannot be read as 3MF: an element has no {error.args[0]}") from None
        except (ValueError, LookupError) as error:
            raise InvalidGeometry(f"cannot be read as 3MF: {error}") from None
        if not self._found_model:
            raise InvalidGeometry("cannot be read as 3MF: it holds no model")
        return self._model

    def _start(self, name: str, attributes: _Attributes) -> None:
        self._depth += 1
        if self._depth > self._limits.max_levels:
            raise LimitExceeded(f"nests its elements {self._depth} levels deep or more, at most {self._limits.max_levels}")
        handle = self._elements.get(name.rpartition(" ")[2])
        if handle is not None:
            handle(attributes)

    def _end(self, name: str) -> None:
        self._depth -= 1

    def _on_model(self, attributes: _Attributes) -> None:
        self._found_model = True
        unit = attributes.get("unit", "millimeter")
        if unit not in _UNITS:
            raise InvalidGeometry(f"states the unit {unit[:40]!r}, which 3MF does not have")
        self._model.unit = _UNITS[unit]

    def _on_object(self, attributes: _Attributes) -> None:
        name, self._object = attributes["id"], _Object()
        if name in self._model.objects:
            raise ValueError(f"it has two objects {name[:40]!r}")
        self._model.objects[name] = self._object

    def _on_vertex(self, attributes: _Attributes) -> None:
        self._object.vertices.extend((real(attributes["x"]), real(attributes["y"]), real(attributes["z"])))

    def _on_triangle(self, attributes: _Attributes) -> None:
        self._object.corners.extend((index(attributes["v1"]), index(attributes["v2"]), index(attributes["v3"])))

    def _on_component(self, attributes: _Attributes) -> None:
        self._object.uses.append(self._use(attributes))

    def _on_item(self, attributes: _Attributes) -> None:
        self._model.build.append(self._use(attributes))

    def _use(self, attributes: _Attributes) -> _Use:
        path = next((value for name, value in attributes.items() if name.rpartition(" ")[2] == "path"), self._file)
        return _Use(path.lstrip("/"), attributes["objectid"], _transformation(attributes.get("transform")))


def _refuse_document_type(*_: object) -> None:
    raise InvalidGeometry("cannot be read as 3MF: it declares a document type; entities are not read")


def _transformation(text: str | None) -> FloatArray:
    """X (4, 4) of 3MF's twelve numbers, which multiply rows from the right."""
    X = np.eye(4)
    if text is not None:
        numbers = [real(word) for word in text.split()]
        if len(numbers) != 12:
            raise ValueError(f"a transform has {len(numbers)} numbers, 12 are needed")
        X[:3] = np.array(numbers).reshape(4, 3).T
    return X
