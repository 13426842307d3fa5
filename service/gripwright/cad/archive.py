"""The files of a product package: a folder or a zip archive, neither of which is trusted."""

import io
import stat
import unicodedata
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from itertools import pairwise
from pathlib import Path, PurePosixPath
from typing import Protocol

from gripwright.cad.document import refuse
from gripwright.cad.limits import Limits
from gripwright.domain.errors import Fault, InvalidInput, LimitExceeded

_RATIO_FROM_BYTES = 2**20  # smaller files cannot do harm, however well they compress
_ARCHIVES = frozenset({".zip", ".gz", ".bz2", ".xz", ".7z", ".rar", ".tar", ".tgz"})
_ENCRYPTED = 0x1
_LISTED = b"PK\1\2"  # begins an entry of the directory, also of archives inside, as 3MF files are
_LISTED_FACTOR = 20
_LOCAL_HEAD_BYTES = 30
_NAME_MAX = 1000  # characters of a name with its folders
_METHODS = {zipfile.ZIP_STORED: "stored", zipfile.ZIP_DEFLATED: "deflated"}
_DAMAGE = (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, OSError, ValueError)


class PackageFiles(Protocol):
    """The files of a package by name: relative paths with / between folders."""

    @property
    def names(self) -> frozenset[str]:
        """Every file."""
        ...

    def read(self, name: str) -> bytes:
        """The content of a file; LimitExceeded where it is larger than allowed."""
        ...


class FolderFiles:
    """A folder. Links that lead out of it are no files of the package."""

    def __init__(self, folder: Path, limits: Limits) -> None:
        self._root, self._limits, self._total = folder.resolve(), limits, 0
        names = set()
        for path in self._root.rglob("*"):
            if path.is_file() and path.resolve().is_relative_to(self._root):
                names.add(path.relative_to(self._root).as_posix())
            if len(names) > limits.max_files:
                raise LimitExceeded(f"the folder holds more than {limits.max_files} files")
        self.names = frozenset(names)

    def read(self, name: str) -> bytes:
        """The content of a file."""
        path = self._root / name
        size = path.stat().st_size
        self._total += size
        check_size(name, size, self._total, self._limits)
        return path.read_bytes()


class ArchiveFiles:
    """A zip archive whose directory was checked (open_archive). Nothing is written to disk."""

    def __init__(self, archive: zipfile.ZipFile, entries: Mapping[str, zipfile.ZipInfo], limits: Limits) -> None:
        self._archive, self._entries, self._limits, self._total = archive, entries, limits, 0
        self.names = frozenset(entries)

    def read(self, name: str) -> bytes:
        """The content of a file; what really comes out is counted, whatever the directory declares."""
        try:
            with self._archive.open(self._entries[name]) as stream:
                data = stream.read(self._limits.max_file_bytes + 1)
        except _DAMAGE as error:
            raise InvalidInput(
                f"{name} cannot be decompressed: {error}", faults=(Fault(name, f"cannot be decompressed: {error}"),)
            ) from None
        self._total += len(data)
        check_size(name, len(data), self._total, self._limits)
        return data


class SingleFile:
    """One file alone."""

    def __init__(self, name: str, read: Callable[[], bytes], limits: Limits) -> None:
        self.names = frozenset({name})
        self._read, self._limits = read, limits

    def read(self, name: str) -> bytes:
        """Its content."""
        data = self._read()
        check_size(name, len(data), len(data), self._limits)
        return data


def open_archive(data: bytes, label: str, limits: Limits, *, of_packages: bool = False) -> ArchiveFiles:
    """A zip archive whose directory keeps to the limits; `label` names it in messages. One `of_packages` may hold .zip files.

    InvalidInput for names that lead out, links, encryption, names given twice and archives inside; LimitExceeded for
    what would be too much.
    """
    listed = data.count(_LISTED)  # before the directory is read, which would take time and memory for each
    if listed > _LISTED_FACTOR * limits.max_files:
        raise LimitExceeded(f"{label} lists {listed} files or so, at most {limits.max_files}")
    try:
        archive = zipfile.ZipFile(io.BytesIO(data))
    except _DAMAGE as error:
        raise InvalidInput(f"{label} is no zip archive: {error}", faults=(Fault(label, f"no zip archive: {error}"),)) from None
    infos = [info for info in archive.infolist() if not info.filename.endswith("/")]
    if len(infos) > limits.max_files:
        raise LimitExceeded(f"{label} holds {len(infos)} files, at most {limits.max_files}")
    entries: dict[str, zipfile.ZipInfo] = {}
    faults = []
    seen: dict[str, str] = {}
    for info in infos:
        message = _entry_fault(info, _ARCHIVES - {".zip"} if of_packages else _ARCHIVES)
        key = unicodedata.normalize("NFC", info.filename).casefold()
        if message is None and key in seen:
            same = seen[key] == info.filename
            message = "given twice in the archive" if same else f"differs from {seen[key]!r} by case or composition alone"
        if message is not None:
            faults.append(Fault(info.filename[:_NAME_MAX], message))
        seen[key] = info.filename
        entries[info.filename] = info
    folders = {str(folder) for name in entries for folder in PurePosixPath(name).parents}
    faults += _overlaps(infos)
    faults += [Fault(name, "both a file and a folder") for name in entries if name in folders]
    if faults:
        refuse(f"{label} cannot be used", faults)
    _check_declared(infos, label, limits)
    return ArchiveFiles(archive, entries, limits)


def _entry_fault(info: zipfile.ZipInfo, refused: frozenset[str]) -> str | None:
    path, kind = PurePosixPath(info.filename), stat.S_IFMT(info.external_attr >> 16)
    if path.is_absolute() or ".." in path.parts or "\\" in info.orig_filename or ":" in info.filename:
        return "the path leads out of the package"
    if not info.filename or not info.orig_filename.isprintable() or len(info.filename) > _NAME_MAX:
        return f"the name has {len(info.filename)} characters; 1 to {_NAME_MAX}, all printable, are allowed"
    if kind == stat.S_IFLNK:
        return "a symbolic link"
    if kind not in (0, stat.S_IFREG):
        return "neither a file nor a folder"
    if info.flag_bits & _ENCRYPTED:
        return "encrypted"
    if info.compress_type not in _METHODS:
        return f"compressed by method {info.compress_type}; {' and '.join(_METHODS.values())} are read"
    if path.suffix.lower() in refused:
        return "an archive inside the archive"
    return None


def _overlaps(infos: list[zipfile.ZipInfo]) -> Iterator[Fault]:
    """Entries that share bytes: bombs are made so."""
    for first, second in pairwise(sorted(infos, key=lambda info: info.header_offset)):
        if first.header_offset + _LOCAL_HEAD_BYTES + first.compress_size > second.header_offset:
            yield Fault(second.filename, f"overlaps {first.filename!r} in the archive")


def _check_declared(infos: list[zipfile.ZipInfo], label: str, limits: Limits) -> None:
    total = 0
    for info in infos:
        total += info.file_size
        check_size(info.filename, info.file_size, total, limits)
        ratio = info.file_size / max(info.compress_size, 1)
        if info.file_size > _RATIO_FROM_BYTES and ratio > limits.max_ratio:
            detail = f"{info.filename} in {label} is compressed {ratio:.0f} : 1, at most {limits.max_ratio:.0f} : 1"
            raise LimitExceeded(detail, faults=(Fault(info.filename, detail),))


def check_size(name: str, size: int, total: int, limits: Limits) -> None:
    """LimitExceeded for a file that is too large, or too large together with those before it."""
    if size > limits.max_file_bytes:
        detail = f"{name} has {size} bytes or more, at most {limits.max_file_bytes}"
        raise LimitExceeded(detail, faults=(Fault(name, detail),))
    if total > limits.max_total_bytes:
        detail = f"the files up to {name} have {total} bytes together, at most {limits.max_total_bytes}"
        raise LimitExceeded(detail, faults=(Fault(name, detail),))


class Subfolder:
    """A folder of a package as the package itself: archives often hold one folder that holds everything."""

    def __init__(self, files: PackageFiles, prefix: str) -> None:
        self._files, self._prefix = files, prefix
        self.names = frozenset(name.removeprefix(prefix) for name in files.names if name.startswith(prefix))

    def read(self, name: str) -> bytes:
        """The content of a file."""
        return self._files.read(self._prefix + name)


def open_package_files(path: Path, limits: Limits) -> PackageFiles:
    """The files of a folder or a .zip; where product.json lies in one folder below, that folder's."""
    if path.is_dir():
        return FolderFiles(path, limits)
    if not path.is_file():
        raise InvalidInput(f"no such file or folder: {path.name}", faults=(Fault(path.name, "no such file or folder"),))
    size = path.stat().st_size
    if size > limits.max_total_bytes:
        raise LimitExceeded(f"{path.name} has {size} bytes, at most {limits.max_total_bytes}")
    return inner_package(open_archive(path.read_bytes(), path.name, limits))


def inner_package(files: PackageFiles) -> PackageFiles:
    """The files themselves, or where product.json lies in one folder below alone, that folder's."""
    below = sorted(name for name in files.names if name.endswith("/product.json") and name.count("/") == 1)
    if "product.json" not in files.names and len(below) == 1:
        return Subfolder(files, below[0].removesuffix("product.json"))
    return files
