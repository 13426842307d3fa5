"""Malformed requests: multipart that is none, wrong files, wrong media types."""

import gzip
import io
import json
import tarfile

from upload_bodies import BOUNDARY, BadUpload, alone, component, cuts, document, form, stl, zipped

_MANIFEST = json.dumps(document()).encode()
_PART = ("files", "part.stl", stl())
_GOOD = form(("manifest", None, _MANIFEST), _PART)
_PACKAGE = alone(zipped([("product.json", _MANIFEST), ("part.stl", stl())]))


def bad_requests():
    for name, body in _bodies():
        yield BadUpload("multipart", name, body)
    for content_type in (
        "multipart/form-data", "multipart/form-data; boundary=", "multipart/form-data; boundary=other",
        "multipart/mixed; boundary=a",
        "application/json", "application/zip", "text/plain", "", "multipart/form-data; boundary=" + "x" * 300, "multipart",
        "application/x-www-form-urlencoded", 'multipart/form-data; boundary="', "multipart/form-data; boundary=a\tb",
        "model/stl", "multipart/form-data;;;=;boundary",
    ):  # fmt: skip
        yield BadUpload("media type", repr(content_type)[:70], _PACKAGE, content_type)
    for charset in ("utf-7", "idna", "unicode_escape", "undefined", "zlib", "utf-16", "punycode", "mbcs", "cp037"):
        body = form(("manifest", None, b'{"part_number": "\\ud800"}'), ("files", "a\\ud800+2AA-.stl", stl()))
        yield BadUpload(
            "media type", f"charset {charset}", body, f"multipart/form-data; boundary={BOUNDARY.decode()}; charset={charset}"
        )
    for name, filename, data in _strangers():
        yield BadUpload("stranger", f"{name} as {filename}", alone(data, filename))
    for filename in _file_names():
        label = filename.encode("unicode_escape").decode()[:60]
        yield BadUpload("file name", label, form(("manifest", None, _MANIFEST), _PART, ("files", filename, stl())))
        yield BadUpload("file name", f"{label}, alone", alone(stl(), filename))


def _bodies():
    for length in cuts(_GOOD, 12, last=len(_GOOD) - 5):
        yield f"cut to {length} bytes", _GOOD[:length]
    for length in cuts(_PACKAGE, 6, last=len(_PACKAGE) - 5):
        yield f"a package cut to {length} bytes", _PACKAGE[:length]
    yield "no end", form(("manifest", None, _MANIFEST), _PART, end=False)
    yield "5,000 parts", form(("manifest", None, _MANIFEST), *(("files", f"{k}.stl", b"") for k in range(5000)))
    yield "5,000 fields", form(*((f"f{k}", None, b"x") for k in range(5000)))
    yield "two manifests", form(("manifest", None, _MANIFEST), ("manifest", None, _MANIFEST), _PART)
    yield "no manifest", form(_PART)
    yield "no part", form(("manifest", None, _MANIFEST))
    yield "another field", form(("manifest", None, _MANIFEST), _PART, ("colour", None, b"red"))
    yield "the part under the field's name alone", form(("manifest", None, _MANIFEST), ("part.stl", None, stl()))
    yield "a part twice", form(("manifest", None, _MANIFEST), _PART, _PART)
    yield "a file that is a folder too", form(("manifest", None, _MANIFEST), _PART, ("files", "part.stl/a.stl", stl()))
    yield "a folder that is a file too", form(("manifest", None, _MANIFEST), ("files", "part.stl/a.stl", stl()), _PART)
    yield "two packages", form(("package", "a.zip", b"PK"), ("package", "b.zip", b"PK"))
    yield "a package and a manifest", form(("manifest", None, _MANIFEST), ("package", "package.zip", zipped([])))
    yield "product.json as a file", form(("files", "product.json", _MANIFEST), _PART)
    yield "a manifest of 9 MB as a field", form(("manifest", None, b" " * 9_000_000), _PART)
    yield "a manifest of 20 MB as a file", form(("manifest", "product.json", b" " * 20_000_000), _PART)
    head = b"--%s\r\n" % BOUNDARY
    yield "nothing", b""
    yield "an end alone", b"--%s--\r\n" % BOUNDARY
    yield "no header", head + b"\r\n" + stl() + b"\r\n--%s--\r\n" % BOUNDARY
    yield "no name", head + b"Content-Disposition: form-data\r\n\r\nx\r\n--%s--\r\n" % BOUNDARY
    yield "a header of 10 MB", head + b"X: " + b"y" * 10_000_000 + b"\r\n\r\nx\r\n--%s--\r\n" % BOUNDARY
    yield "100,000 headers", head + b"X: y\r\n" * 100_000 + b"\r\nx\r\n--%s--\r\n" % BOUNDARY
    yield "a header with NUL", head + b'Content-Disposition: form-data; name="a\0b"\r\n\r\nx\r\n--%s--\r\n' % BOUNDARY
    yield "a header without colon", head + b"Content-Disposition\r\n\r\nx\r\n--%s--\r\n" % BOUNDARY
    yield "line feeds alone", _GOOD.replace(b"\r\n", b"\n")
    yield (
        "base64",
        head
        + b'Content-Disposition: form-data; name="package"; filename="a.zip"\r\nContent-Transfer-Encoding: base64\r\n\r\n'
        + (b"UEsDBAoAAAAA\r\n--%s--\r\n" % BOUNDARY),
    )
    yield "noise", bytes((k * 2_654_435_761 >> 7) & 255 for k in range(5000))
    yield "gzip", gzip.compress(_PACKAGE)


def _strangers():
    tar = io.BytesIO()
    with tarfile.open(fileobj=tar, mode="w:gz") as archive:
        archive.addfile(tarfile.TarInfo("product.json"))
    kinds = {
        "rar": b"Rar!\x1a\x07\x01\x00" + bytes(40),
        "7z": b"7z\xbc\xaf\x27\x1c" + bytes(40),
        "pdf": b"%PDF-1.7\n1 0 obj\n<<>>\nendobj\n%%EOF\n",
        "exe": b"MZ" + bytes(60) + b"PE\0\0",
        "gz": gzip.compress(b"solid"),
        "tgz": tar.getvalue(),
        "empty": b"",
        "html": b"<!doctype html><script>alert(1)</script>",
        "png": b"\x89PNG\r\n\x1a\n" + bytes(30),
        "elf": b"\x7fELF" + bytes(60),
    }
    for name, data in kinds.items():
        for filename in ("package.zip", "part.step", f"package.{name}"):
            yield name, filename, data
    yield "stl", "part.stl", stl()
    yield "a package", "package.rar", zipped([("product.json", _MANIFEST), ("part.stl", stl())])
    yield "a package", "package", zipped([("product.json", _MANIFEST), ("part.stl", stl())])
    yield "a package", "part.step", zipped([("product.json", _MANIFEST), ("part.stl", stl())])
    for extension in ("obj", "ply", "off", "3mf", "glb", "step", "stp"):
        units = None if extension in ("3mf", "glb", "step", "stp") else "mm"
        manifest = json.dumps(document(component(f"part.{extension}", units)))
        yield (
            "a package of an stl called " + extension,
            "package.zip",
            zipped([("product.json", manifest), (f"part.{extension}", stl())]),
        )
        yield (
            "a package of an empty " + extension,
            "package.zip",
            zipped([("product.json", manifest), (f"part.{extension}", b"")]),
        )


def _file_names():
    return (
        "../part.stl", "/etc/part.stl", "C:\\part.stl", "..\\part.stl", "a/../../part.stl", "a\x00.stl", "x" * 600 + ".stl",
        ".stl/../..",
        "a/" * 300 + "a.stl", "..", ".", "", "part.stl ", "part.exe", "\u202e.lts", "a\tb.stl", "\x7f.stl", "a%00.step/..",
        "x" * 600 + ".step\x00",
    )  # fmt: skip
