"""Malformed product packages: bombs, lying headers, names that lead out, damage. (name, bytes of the .zip)."""

import io
import json
import stat
import struct
import zipfile
import zlib

from upload_bodies import component, cuts, document, flipped, stl, zipped

_MANIFEST = json.dumps(document())
_GOOD = [("product.json", _MANIFEST), ("part.stl", stl())]


def bad_archives():
    yield from _damaged()
    yield from _names()
    yield from _contents()


def _damaged():
    data = zipped(_GOOD)
    for length in cuts(data, 16):
        yield f"cut to {length} bytes", data[:length]
    for name in ("product.json", "part.stl"):
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            info = archive.getinfo(name)
        start = info.header_offset + 30 + len(name)
        for k in range(6):
            byte = start + info.compress_size * k // 6
            yield f"bit 3 of byte {byte} of {name} turned", flipped(data, 8 * byte + 3)
    end = data.rindex(b"PK\5\6")
    directory = data.index(b"PK\1\2")
    for name, offset, value in (
        ("the directory lies beyond the end", end + 16, 2**31),
        ("the directory is larger than the file", end + 12, 2**31),
        ("the directory holds nothing", end + 12, 0),
        ("an entry lies beyond the end", directory + 42, 2**31),
        ("an entry has another sum", directory + 16, 12345),
        ("an entry declares 4 GB", directory + 24, 2**32 - 2),
        ("an entry declares less than comes out", directory + 24, 3),
        ("an entry's compressed size is a lie", directory + 20, 5),
        ("an entry is compressed by a method that is not", directory + 10, 77),
    ):
        yield name, data[:offset] + struct.pack("<I", value) + data[offset + 4 :]
    yield "reversed", data[::-1]
    yield "an end and nothing else", b"PK\5\6" + bytes(18)
    yield "zip64 lies", data[:end] + b"PK\6\6" + struct.pack("<QHHIIQQQQ", 44, 45, 45, 0, 0, 2**60, 2**60, 2**60, 0) + data[end:]


def bombs():
    zeros = bytes(300_000_000)
    yield "300 MB of zeros as the part", zipped([("product.json", _MANIFEST), ("part.stl", zeros)])
    yield "300 MB of zeros as the manifest", zipped([("product.json", zeros), ("part.stl", stl())])
    yield "300 MB of zeros beside them", zipped([*_GOOD, ("more.stl", zeros)])
    inner = zipped([("0", bytes(10_000_000))])
    for level in range(5):
        inner = zipped([(f"{level}{k}.zip", inner) for k in range(8)])
    yield "archives in archives", zipped([*_GOOD, ("more.zip", inner)])
    yield "an archive alone", zipped([("more.zip", inner)])
    yield "100 files of 1 MB that compress well, and more", zipped([*_GOOD, *((f"{k}.stl", bytes(2**20)) for k in range(1100))])
    yield "3,000 files", zipped([*_GOOD, *((f"{k}.stl", b"") for k in range(3000))])
    yield "65,000 files", zipped([*_GOOD, *((f"{k}.stl", b"") for k in range(65_000))])
    yield "overlapping entries", _overlapping(250)
    yield "300,000 entries of one file", _one_file_often(300_000)
    for name, method in (("bzip2", zipfile.ZIP_BZIP2), ("LZMA", zipfile.ZIP_LZMA)):
        yield f"300 MB of zeros by {name}", zipped([("product.json", _MANIFEST), ("part.stl", zeros)], method)
    spaces = b" " * 15_000_000
    yield "a manifest of 15 MB of blanks", zipped([("product.json", spaces), ("part.stl", stl())])


def _entry(name, offset, crc, compressed, size):
    head = struct.pack(
        "<IHHHHHHIIIHHHHHII", 0x02014B50, 20, 20, 0, 8, 0, 33, crc, compressed, size, len(name), 0, 0, 0, 0, 0, offset
    )
    return head + name


def _local(name, crc, compressed, size):
    return struct.pack("<IHHHHHIIIHH", 0x04034B50, 20, 0, 8, 0, 33, crc, compressed, size, len(name), 0) + name


def _end(entries, start):
    directory = b"".join(entries)
    return directory + struct.pack(
        "<IHHHHIIH", 0x06054B50, 0, 0, len(entries) & 0xFFFF, len(entries) & 0xFFFF, len(directory), start, 0
    )


def _overlapping(count):
    """After Fifield: each entry's data is the next entry's header, quoted, and all that follows; one kernel for all."""
    size = 2_000_000
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    plain, packed = bytes(size), packer.compress(bytes(size)) + packer.flush()
    crc, compressed = zlib.crc32(plain), len(packed)
    name = b"%04d.stl" % (count - 1)
    body, entries = _local(name, crc, compressed, size) + packed, [(name, 0, crc, compressed, size)]
    for k in reversed(range(count - 1)):
        quoted = body[: 30 + len(name)]
        quote = b"\x00" + struct.pack("<HH", len(quoted), len(quoted) ^ 0xFFFF)
        crc, compressed, size = zlib.crc32(quoted + plain), compressed + len(quote) + len(quoted), size + len(quoted)
        plain = quoted + plain
        name = b"product.json" if k == 0 else b"%04d.stl" % k
        head = _local(name, crc, compressed, size) + quote
        entries = [(n, offset + len(head), *rest) for n, offset, *rest in entries]
        entries.append((name, 0, crc, compressed, size))
        body = head + body
    return body + _end([_entry(*entry) for entry in entries], len(body))


def _one_file_often(count):
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    packed = packer.compress(b"{}") + packer.flush()
    facts = (zlib.crc32(b"{}"), len(packed), 2)
    body = _local(b"product.json", *facts) + packed
    return body + _end([_entry(b"%d.stl" % k if k else b"product.json", 0, *facts) for k in range(count)], len(body))


def _names():
    for name in (
        "../part2.stl", "a/../../part2.stl", "/etc/part2.stl", "C:/part2.stl", "c:part2.stl", "..\\part2.stl", "a\\part2.stl",
        "\\\\host\\share\\part2.stl", "..", "a/..", "//part2.stl", "part\n2.stl", "part2\u202elts.stl", "\u200bpart2.stl",
        "a/" * 2000 + "part2.stl", "x" * 5000 + ".stl", "file:///part2.stl", "CON:", "~/../part2.stl", "./../part2.stl",
    ):  # fmt: skip
        yield f"holds {name.encode('unicode_escape').decode()[:60]}", zipped([*_GOOD, (name, stl())])
        named = json.dumps(document(component(name)))
        yield f"its manifest names {name.encode('unicode_escape').decode()[:60]}", zipped([("product.json", named), *_GOOD[1:]])
    nothing = zipped([*_GOOD, ("partX2.stl", stl())]).replace(b"partX2.stl", b"\x00artX2.stl")
    yield "a name that is empty", nothing
    nul = zipped([*_GOOD, ("partX2.stl", stl())]).replace(b"partX2.stl", b"part\x002.stl")
    yield "a name with NUL", nul
    yield "a name that is no UTF-8", zipped([*_GOOD, ("pärt.stl", stl())]).replace("pä".encode(), b"p\xff\xfe")
    link = zipfile.ZipInfo("part.stl")
    link.external_attr = (stat.S_IFLNK | 0o777) << 16
    yield "the part is a symbolic link", zipped([_GOOD[0], (link, b"/etc/passwd")])
    for kind, mode in (("a device", stat.S_IFCHR), ("a pipe", stat.S_IFIFO), ("a socket", stat.S_IFSOCK)):
        special = zipfile.ZipInfo("part.stl")
        special.external_attr = (mode | 0o666) << 16
        yield f"the part is {kind}", zipped([_GOOD[0], (special, stl())])
    yield "the part is a folder", zipped([_GOOD[0], ("part.stl/", b"")])
    yield "the manifest twice", zipped([*_GOOD, ("product.json", "{}")])
    yield "the part twice", zipped([*_GOOD, ("part.stl", stl())])
    yield "two parts that differ by case", zipped([*_GOOD, ("PART.stl", stl())])
    yield "two parts that differ by composition", zipped([*_GOOD, ("ü.stl", stl()), ("u\u0308.stl", stl())])
    yield "a file that is a folder too", zipped([*_GOOD, ("part.stl/inner.stl", stl())])
    yield "the part's name in other letters", zipped([_GOOD[0], ("Part.STL", stl())])


def _contents():
    yield "empty", zipped([])
    yield "no manifest", zipped(_GOOD[1:])
    yield "no part", zipped(_GOOD[:1])
    yield (
        "two manifests in folders",
        zipped([("a/product.json", _MANIFEST), ("b/product.json", _MANIFEST), ("a/part.stl", stl())]),
    )
    yield "the manifest two folders down", zipped([(f"a/b/{name}", data) for name, data in _GOOD])
    data = zipped(_GOOD, zipfile.ZIP_STORED)
    directory = data.index(b"PK\1\2")
    yield "encrypted", data[: directory + 8] + b"\1\0" + data[directory + 10 :]
    for extension in ("gz", "tar", "7z", "rar"):
        yield f"a .{extension} inside", zipped([*_GOOD, (f"more.{extension}", b"x")])
    yield "an archive inside by another name", zipped([_GOOD[0], ("part.stl", zipped(_GOOD))])
