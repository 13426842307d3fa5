"""Bodies of uploads: a product of one component around any file, as a .zip, as parts, or a file that stands alone."""

import io
import json
import struct
import zipfile
from dataclasses import dataclass

BOUNDARY = b"hostile-boundary"
MULTIPART = f"multipart/form-data; boundary={BOUNDARY.decode()}"


@dataclass(frozen=True, slots=True)
class BadUpload:
    """An upload that no service can take: what it is, and the request as it is sent."""

    kind: str
    name: str
    body: bytes
    content_type: str = MULTIPART

    @property
    def label(self):
        return f"{self.kind}: {self.name}"


def form(*parts, end=True):
    """A multipart body of (name, file name or None, bytes)."""
    body = b""
    for name, filename, data in parts:
        disposition = f'form-data; name="{name}"' + (f'; filename="{filename}"' if filename is not None else "")
        body += b"--%s\r\nContent-Disposition: %s\r\n\r\n%s\r\n" % (BOUNDARY, disposition.encode(), data)
    return body + (b"--%s--\r\n" % BOUNDARY if end else b"")


def alone(data, filename="package.zip"):
    return form(("package", filename, data))


def component(file="part.stl", units="mm", id="part", **fields):
    return {"id": id, "file": file, **({} if units is None else {"units": units}), **fields}


def document(*components, **fields):
    """A manifest; one component without any given."""
    return {"part_number": "H-1", "revision": "A", "components": list(components) or [component()], **fields}


def zipped(files, compression=zipfile.ZIP_DEFLATED):
    """A .zip of (name, bytes) in this order."""
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", compression) as archive:
        for name, data in files:
            archive.writestr(name, data)
    return target.getvalue()


def package_of(data, extension):
    """The body of a package whose one component is this file."""
    units = None if extension in ("step", "stp", "3mf", "glb") else "mm"
    manifest = json.dumps(document(component(f"part.{extension}", units)))
    return alone(zipped([("product.json", manifest), (f"part.{extension}", data)]))


def stl(count=None, triangles=4):
    """A binary STL of a wedge; `count` is what it declares."""
    corners = [(0, 0, 0), (10, 0, 0), (0, 10, 0), (0, 0, 10)]
    faces = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)][:triangles]
    records = b"".join(struct.pack("<12fH", 0, 0, 0, *(x for c in face for x in corners[c]), 0) for face in faces)
    return bytes(80) + struct.pack("<I", len(faces) if count is None else count) + records


def flipped(data, bit):
    """The data with one bit turned round."""
    changed = bytearray(data)
    changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


def cuts(data, count, first=0, last=None):
    """Lengths to which a file is cut, evenly between `first` and `last`."""
    last = len(data) - 1 if last is None else last
    return sorted({first + (last - first) * k // max(count - 1, 1) for k in range(count)})
