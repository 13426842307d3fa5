"""Malformed STL, OBJ, PLY and OFF files: (format, name, bytes)."""

import struct

from upload_bodies import cuts, stl

POINTS = ((0, 0, 0), (10, 0, 0), (0, 10, 0), (0, 0, 10))
FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3))
WORDS = {"NaN": "nan", "infinity": "inf", "minus infinity": "-inf", "1e308": "1e308", "1e999": "1e999", "a word": "ten"}


def ascii_stl(first="10"):
    text = "solid wedge\n"
    for face in FACES:
        text += "facet normal 0 0 0\nouter loop\n"
        text += "".join("vertex {} {} {}\n".format(*POINTS[corner]) for corner in face)
        text += "endloop\nendfacet\n"
    return (text + "endsolid wedge\n").replace("vertex 10 0 0", f"vertex {first} 0 0").encode()


def obj(first="10", faces=FACES):
    lines = [f"v {x} {y} {z}" for x, y, z in POINTS] + ["f " + " ".join(str(c + 1) for c in face) for face in faces]
    return ("\n".join(lines) + "\n").replace("v 10 ", f"v {first} ").encode()


def off(first="10", counts="4 4 0", face="3 2 0 3"):
    lines = ["OFF", counts, *(f"{x} {y} {z}" for x, y, z in POINTS), *(f"3 {a} {b} {c}" for a, b, c in FACES[:3]), face]
    return ("\n".join(lines) + "\n").replace("\n10 0 0\n", f"\n{first} 0 0\n").encode()


def ply(order="binary_little_endian", vertices="4", faces="4", header="", corners=3, first=10.0):
    """A PLY whose header may lie; `corners` is the length that its first list declares."""
    head = (
        f"ply\nformat {order} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {faces}\nproperty list uint int vertex_indices\n{header}end_header\n"
    ).encode()
    points = [POINTS[0], (first, 0, 0), *POINTS[2:]]
    lengths = [corners, 3, 3, 3]
    if order == "ascii":
        rows = [f"{x} {y} {z}" for x, y, z in points] + [f"{n} {a} {b} {c}" for n, (a, b, c) in zip(lengths, FACES, strict=True)]
        return head + "\n".join(rows).encode() + b"\n"
    mark = "<" if "little" in order else ">"
    body = b"".join(struct.pack(f"{mark}3f", *point) for point in points)
    return head + body + b"".join(struct.pack(f"{mark}I3i", n, *face) for n, face in zip(lengths, FACES, strict=True))


def bad_polygon_files():
    for format, files in (("stl", _stl()), ("obj", _obj()), ("off", _off()), ("ply", _ply())):
        for name, data in files:
            yield format, name, data


def _stl():
    data = stl()
    for length in cuts(data, 12):
        yield f"binary, cut to {length} bytes", data[:length]
    for count in (5, 10_000_000, 4_000_000_000, 2**32 - 1):
        yield f"binary, declares {count} triangles, holds 4", stl(count)
    for bit in range(3, 32, 4):
        yield f"binary, bit {bit} of the number of triangles turned", stl(4 ^ (1 << bit))
    yield "binary, no triangle", stl(0, 0)
    for name, value in (("NaN", float("nan")), ("infinity", float("inf")), ("1e38", 1e38)):
        yield f"binary, a coordinate is {name}", data[:96] + struct.pack("<f", value) + data[100:]
    text = ascii_stl()
    for length in cuts(text, 12, first=6, last=len(text) - 16):
        yield f"ASCII, cut to {length} bytes", text[:length]
    for name, word in WORDS.items():
        yield f"ASCII, a coordinate is {name}", ascii_stl(word)
    yield "ASCII, a facet of four corners", text.replace(b"endloop", b"vertex 1 1 1\nendloop", 1)
    yield "ASCII in UTF-16", text.decode().encode("utf-16")
    yield "ASCII with NUL between the letters", text.replace(b"vertex", b"v\0ertex")
    yield "ASCII, numbers with underscores", ascii_stl("1_0")
    yield "ASCII, a decimal comma", ascii_stl("10,5")


def _obj():
    for name, word in WORDS.items():
        yield f"a coordinate is {name}", obj(word)
    for index in (0, 5, -5, 2**31, 2**63, 10**30, "9" * 5000, "1.5", "x", "1_0", "nan"):
        yield f"a corner is {str(index)[:30]}", obj() + f"f 1 2 {index}\n".encode()
    yield "a vertex of two coordinates", obj().replace(b"v 10 0 0", b"v 10 0")
    yield "faces alone", obj()[obj().index(b"f") :]
    yield "vertices alone", obj()[: obj().index(b"f")]
    yield "UTF-16", obj().decode().encode("utf-16")
    yield "a face of no corners", obj() + b"f\n"
    for length in (3, 8, 12):
        yield f"cut to {length} bytes", obj()[:length]


def _off():
    data = off()
    for length in cuts(data, 12, last=len(data) - 3):
        yield f"cut to {length} bytes", data[:length]
    for name, word in WORDS.items():
        yield f"a coordinate is {name}", off(word)
    for counts in ("4 5 0", "5 4 0", "-4 4 0", "4 -4 0", "4000000000 4 0", "4 4000000000 0", "4", "x y z", "1e3 4 0", "9" * 5000):
        yield f"counts are {counts[:20]}", off(counts=counts)
    faces = ("4 2 0 3", "-3 2 0 3", "4000000000 2 0 3", "3 2 0 99", "3 2 0 -1", f"3 2 0 {10**30}", "3 2 0 x", "3", "nan 2 0 3")
    for face in faces:
        yield f"a face is {face[:20]}", off(face=face)
    yield "no keyword", data[4:]
    yield "UTF-16", data.decode().encode("utf-16")
    yield "binary", b"OFF BINARY\n" + struct.pack(">3i", 4, 4, 0)


def _ply():
    for order in ("ascii", "binary_little_endian", "binary_big_endian"):
        data = ply(order)
        for length in cuts(data, 9, last=len(data) - 3):
            yield f"{order}, cut to {length} bytes", data[:length]
        for corners in (4, 2**31, 2**32 - 1):
            yield f"{order}, a list that says {corners} corners", ply(order, corners=corners)
        yield f"{order}, NaN", ply(order, first=float("nan"))
        yield f"{order}, 1e30", ply(order, first=1e30)
        for count in ("-1", "-4", "5", "4000000000", "1e9", "x", "9" * 5000):
            yield f"{order}, {count[:12]} vertices", ply(order, vertices=count)
            yield f"{order}, {count[:12]} faces", ply(order, faces=count)
    yield "a list of negative length", ply("ascii", corners=-3)
    yield "corners that are no integers", ply("ascii").replace(b"3 0 2 1", b"3 0 2.5 1")
    yield "unknown byte order", ply().replace(b"binary_little_endian", b"binary_middle_endian")
    yield "no format", ply("ascii").replace(b"format ascii 1.0\n", b"")
    yield "a type that PLY does not have", ply().replace(b"property float y", b"property quad y")
    yield "a property before any element", ply("ascii").replace(b"element vertex 4\n", b"")
    yield "two properties of one name", ply().replace(b"property float y", b"property float x")
    yield "an element without properties", ply(header="element nothing 4000000000\n")
    yield "no z", ply("ascii").replace(b"property float z\n", b"")
    yield "no corners", ply().replace(b"vertex_indices", b"vertex_colours")
    yield (
        "two elements of vertices",
        ply("ascii", header="element vertex 1\nproperty float x\nproperty float y\nproperty float z\n"),
    )
    yield "a header in UTF-16", ply("ascii").decode().encode("utf-16")
    yield "a header without end", ply().replace(b"end_header", b"no_header!")
    yield "a header of 100,000 elements", ply("ascii", header="element e 1000000\nproperty float x\n" * 100_000)
