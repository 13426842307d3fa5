"""Malformed GLB and 3MF files: (format, name, bytes)."""

import copy
import json
import struct

from polygon_files import FACES, POINTS
from upload_bodies import cuts, flipped, zipped

_POSITIONS = b"".join(struct.pack("<3f", *(c / 1000 for c in point)) for point in POINTS)
_INDICES = b"".join(struct.pack("<3I", *face) for face in FACES)


def gltf():
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [0.01, 0.01, 0.01]},
            {"bufferView": 1, "componentType": 5125, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 48},
        ],
        "buffers": [{"byteLength": 96}],
    }


def glb(document=None, binary=_POSITIONS + _INDICES, text=None):
    text = json.dumps(document or gltf()).encode() if text is None else text
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


_CHANGES = [
    (("accessors", 0, "count"), [0, -1, 5, 2**31, 2**63, 10**30, "4", None, 4.5]),
    (("accessors", 0, "byteOffset"), [-12, 4, 48, 2**40]),
    (("accessors", 0, "componentType"), [5125, 1, "x", None]),
    (("accessors", 0, "type"), ["SCALAR", "VEC4", "VEC9", 3]),
    (("accessors", 0, "bufferView"), [1_000_000, -1, "0"]),
    (("accessors", 1, "count"), [11, 13, 4_000_000_000]),
    (("accessors", 1, "componentType"), [5121 + 1000, 5126]),
    (("accessors", 1, "bufferView"), [7]),
    (("bufferViews", 0, "byteOffset"), [-1, 96, 2**40]),
    (("bufferViews", 0, "byteLength"), [47, -48, 2**40]),
    (("bufferViews", 0, "buffer"), [3, -1]),
    (("bufferViews", 0, "byteStride"), [4, 252, -12]),
    (("buffers", 0, "uri"), ["file:///etc/passwd", "../secret.bin", "https://example.com/a.bin", "data:x"]),
    (("buffers", 0, "byteLength"), [10_000, -1]),
    (("nodes", 0, "mesh"), [9, -1, "0"]),
    (("nodes", 0, "children"), [[0], [5], [-1], "0"]),
    (("nodes", 0, "matrix"), [[1, 2], [0] * 16, ["x"] * 16, [1e300] * 16]),
    (("nodes", 0, "scale"), [[0, 0, 0], [1e30, 1e30, 1e30], [1]]),
    (("nodes", 0, "rotation"), [[0, 0, 0, 0], [1, 2]]),
    (("meshes", 0, "primitives"), [[], [{}], {}, [{"attributes": {}}]]),
    (("meshes", 0, "primitives", 0, "mode"), [0, 1, 99, "x"]),
    (("meshes", 0, "primitives", 0, "attributes", "POSITION"), [1, 99, -1]),
    (("meshes", 0, "primitives", 0, "indices"), [0, 99, -2]),
    (("scenes", 0, "nodes"), [[], [7], [0, 0], "all"]),
    (("scene",), [4, -1, "x"]),
    (("asset",), [{}, {"version": "1.0"}, {"version": "3.0"}, 2]),
    (("extensionsRequired",), [["KHR_draco_mesh_compression"], ["EXT_meshopt_compression"], "all"]),
]


def bad_scene_files():
    for name, data in _glb():
        yield "glb", name, data
    for name, data in _3mf():
        yield "3mf", name, data


def _glb():
    data = glb()
    for length in cuts(data, 14):
        yield f"cut to {length} bytes", data[:length]
    for bit in (0, 9, 33, 34, 64, 70, 80, 96, 101, 130, 159):
        yield f"bit {bit} of the head turned", flipped(data, bit)
    for path, values in _CHANGES:
        for value in values:
            changed = copy.deepcopy(gltf())
            target = changed
            for step in path[:-1]:
                target = target[step]
            target[path[-1]] = value
            yield f"{'/'.join(map(str, path))} is {json.dumps(value)[:40]}", glb(changed)
    for key in ("nodes", "meshes", "accessors", "bufferViews", "buffers"):
        yield f"no {key}", glb({name: value for name, value in gltf().items() if name != key})
    yield "a corner beyond the last vertex", glb(binary=_POSITIONS + struct.pack("<I", 99) + _INDICES[4:])
    yield "a coordinate is NaN", glb(binary=struct.pack("<f", float("nan")) + _POSITIONS[4:] + _INDICES)
    sparse = gltf()
    sparse["accessors"][0] |= {"sparse": {"count": 99, "indices": {"bufferView": 0}, "values": {"bufferView": 0}}}
    yield "sparse", glb(sparse)
    draco = gltf()
    draco["meshes"][0]["primitives"][0]["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": 0}}
    draco["extensionsRequired"] = draco["extensionsUsed"] = ["KHR_draco_mesh_compression"]
    yield "Draco", glb(draco)
    ring = gltf()
    ring["nodes"] = [{"children": [1]}, {"children": [2]}, {"children": [0], "mesh": 0}]
    yield "a ring of nodes", glb(ring)
    deep = gltf()
    deep["nodes"] = [{"children": [k + 1]} for k in range(20_000)] + [{"mesh": 0}]
    yield "20,000 nodes one in the other", glb(deep)
    wide = gltf()
    wide["nodes"] = [{"children": [k + 1, k + 1]} for k in range(40)] + [{"mesh": 0}]
    yield "2^40 instances", glb(wide)
    lone = gltf()
    lone["nodes"] = [{"mesh": 0} for _ in range(20_000)]
    lone["meshes"][0]["primitives"] *= 1000
    lone["scenes"] = [{"nodes": list(range(20_000))}]
    yield "20 million instances", glb(lone)
    for name, text in (("nested 100,000 deep", b"[" * 100_000), ("NaN", b'{"a": NaN}'), ("no object", b"[]"), ("empty", b"")):
        yield f"JSON is {name}", glb(text=text)


_NAMESPACE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"


def model(before="", unit="millimeter", vertices=None, triangles=None, objects="", build='<item objectid="1"/>'):
    points = "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in POINTS) if vertices is None else vertices
    corners = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in FACES) if triangles is None else triangles
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>{before}<model unit="{unit}" xmlns="{_NAMESPACE}"><resources>'
        f'<object id="1" type="model"><mesh><vertices>{points}</vertices><triangles>{corners}</triangles></mesh></object>'
        f"{objects}"
        f"</resources><build>{build}</build></model>"
    )


def threemf(text, extra=()):
    relation = (
        '<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
        '<Relationship Target="/3D/3dmodel.model" Id="r0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>'
        "</Relationships>"
    )
    data = text.encode() if isinstance(text, str) else text
    return zipped([("_rels/.rels", relation), ("3D/3dmodel.model", data), *extra])


def _composed(id, *parts):
    return (
        f'<object id="{id}"><components>'
        + "".join(f'<component objectid="{part}"/>' for part in parts)
        + "</components></object>"
    )


def _3mf():
    data = threemf(model())
    for length in cuts(data, 12):
        yield f"cut to {length} bytes", data[:length]
    laughs = "".join(f'<!ENTITY a{k} "{f"&a{k - 1};" * 10}">' for k in range(1, 12))
    yield "a billion laughs", threemf(model(f'<!DOCTYPE model [<!ENTITY a0 "ha">{laughs}]>', objects="<note>&a11;</note>"))
    for where in ("file:///etc/passwd", "http://127.0.0.1:9/x", "file:///dev/zero"):
        start = f'<!DOCTYPE model [<!ENTITY x SYSTEM "{where}">]>'
        yield f"an entity from {where}", threemf(model(start, objects="<note>&x;</note>"))
        yield f"a unit that is an entity from {where}", threemf(model(f'<!DOCTYPE model SYSTEM "{where}">'))
    yield "a component of itself", threemf(model(objects=_composed(2, 2), build='<item objectid="2"/>'))
    yield "a ring of components", threemf(model(objects=_composed(2, 3) + _composed(3, 2, 1), build='<item objectid="2"/>'))
    doubled = "".join(_composed(k + 1, k, k) for k in range(1, 40))
    yield "2^39 instances", threemf(model(objects=doubled, build='<item objectid="40"/>'))
    chain = "".join(_composed(k + 1, k) for k in range(1, 20_000))
    yield "20,000 components one in the other", threemf(model(objects=chain, build='<item objectid="20000"/>'))
    for unit in ("furlong", "", "mm", "parsec"):
        yield f"the unit is {unit!r}", threemf(model(unit=unit))
    for word in ("nan", "inf", "1e999", "ten", "", "1 2 3", "1_0"):
        yield f"a coordinate is {word!r}", threemf(model().replace('x="10"', f'x="{word}"'))
    for word in ("4", "-1", "99999999999999999999", "1.5", "x", "", "0 1 2"):
        yield f"a corner is {word!r}", threemf(model().replace('v3="1"', f'v3="{word}"'))
    for name, text in (
        ("a vertex without z", model().replace(' z="10"', "")),
        ("a triangle without v3", model().replace(' v3="3"', "")),
        ("an item of an object that is not there", model(build='<item objectid="77"/>')),
        ("a component that is not there", model(objects=_composed(2, 77), build='<item objectid="2"/>')),
        ("nothing is built", model(build="")),
        ("no triangles", model(triangles="")),
        ("a transform of two numbers", model(build='<item objectid="1" transform="1 2"/>')),
        ("a transform of words", model(build=f'<item objectid="1" transform="{" x" * 12}"/>')),
        ("a transform to nothing", model(build=f'<item objectid="1" transform="{"0 " * 12}"/>')),
        ("an object without id", model().replace('id="1" type', "type")),
        ("two objects of one id", model(objects='<object id="1"/>')),
        ("not closed", model()[:-30]),
        ("elements 100,000 deep", model(objects="<a>" * 100_000 + "</a>" * 100_000)),
        ("no model", "<nothing/>"),
        ("no XML", "solid\n"),
        ("an encoding that is not", model().replace("UTF-8", "KLINGON")),
        ("empty", ""),
        ("an attribute twice", model().replace("<item ", '<item objectid="1" ')),
    ):
        yield name, threemf(text)
    yield "no model in the archive", zipped([("readme.txt", b"hello")])
    yield "a bomb inside", threemf(model(objects="<note>" + " " * 60_000_000 + "</note>"))
    yield "an archive inside", threemf(model(), [("inner.zip", zipped([("a", b"a")]))])
    yield "a name that leads out", threemf(model(), [("../../out.txt", b"x")])
