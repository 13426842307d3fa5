"""Fuzzing of what reads uploads.

`python tests/soak/fuzz_parsers.py parsers [SECONDS]`: coverage-guided (atheris) on our own parsers, in a process of its own.
`python tests/soak/fuzz_parsers.py service [SECONDS]`: mutated files and requests to a real service.
`python tests/soak/fuzz_parsers.py`: both, ten minutes each.
Anything but a mesh, a manifest or a GripwrightError, and any answer of 500 and more, is a finding; findings are kept, and the
exit code says whether there are any.
"""

import hashlib
import json
import random
import subprocess
import sys
import tempfile
import time
import traceback
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import atheris
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "hostile"))

with atheris.instrument_imports(include=["gripwright.cad", "gripwright.domain"]):
    from archive_files import bad_archives
    from corpus import small_corpus
    from hostile_service import LONGEST_S, hostile_service
    from manifest_files import bad_manifests
    from polygon_files import ascii_stl, bad_polygon_files, obj, off, ply
    from scene_files import bad_scene_files, glb, model, threemf
    from step_files import block
    from upload_bodies import BadUpload, alone, document, form, package_of, stl, zipped

    from gripwright.cad.archive import open_archive
    from gripwright.cad.colour import component_glb
    from gripwright.cad.export import threemf_bytes
    from gripwright.cad.limits import Limits
    from gripwright.cad.manifest import read_manifest
    from gripwright.cad.operations import read_operations
    from gripwright.cad.read import read_mesh
    from gripwright.domain.errors import GripwrightError
    from service_factory import make_document, make_package, make_wedge

FORMATS = ("stl", "obj", "off", "ply", "glb", "3mf")
TARGETS = (*FORMATS, "manifest", "operations", "archive")
LIMITS = Limits(max_file_bytes=2**20, max_total_bytes=2**22, max_triangles=20_000, max_instances=2000)
_LONGEST_INPUT = 4096
_AT_A_TIME = 2
_SECONDS = 600
_INSIDE = "inside"  # how this script is called by itself


def parse(data: bytes) -> None:
    """One input: its first byte says which parser."""
    target, rest = TARGETS[data[0] % len(TARGETS)], data[1:]
    if target in FORMATS:
        mesh = read_mesh(rest, target, None if target in ("glb", "3mf") else "mm", LIMITS)
        assert np.isfinite(mesh.vertices_mm).all()
        assert 0 <= mesh.faces.min() <= mesh.faces.max() < len(mesh.vertices_mm)
    elif target == "manifest":
        assert read_manifest(rest, LIMITS).components
    elif target == "operations":
        read_operations(rest, ["base", "rotor", "part"], LIMITS)
    else:
        files = open_archive(rest, "package.zip", LIMITS)
        for name in sorted(files.names):
            files.read(name)


def seeds():
    good = [
        ("stl", stl()), ("stl", ascii_stl()), ("obj", obj()), ("off", off()), ("glb", glb()), ("3mf", threemf(model())),
        ("ply", ply()), ("ply", ply("ascii")), ("ply", ply("binary_big_endian")),
        ("glb", component_glb("wedge", make_wedge())), ("3mf", threemf_bytes(make_wedge(), "wedge")),
        ("manifest", _json(make_document())), ("operations", _json(make_document()["operations"])),
        ("archive", zipped([("product.json", _json(document())), ("part.stl", stl())])),
    ]  # fmt: skip
    yield from good
    yield from ((format, data) for format, _, data in (*bad_polygon_files(), *bad_scene_files()))
    yield from (("manifest", data) for _, data in bad_manifests())
    yield from (("archive", data) for _, data in bad_archives())


def _json(value) -> bytes:
    return json.dumps(value).encode()


class Findings:
    """Defects, one for each place that raises, with the input that shows it."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._seen = folder, set()
        folder.mkdir(parents=True, exist_ok=True)

    def add(self, place: str, data: bytes, what: str) -> None:
        if place not in self._seen:
            self._seen.add(place)
            path = self._folder / hashlib.sha256(data).hexdigest()[:16]
            path.write_bytes(data)
            print(f"FINDING {len(self._seen)} at {place}: {what}\n  input: {path}", flush=True)

    def __len__(self) -> int:
        return len(self._seen)


def fuzz_parsers(seconds: int, folder: Path) -> int:
    """The fuzzer ends its process itself; what it has found are files."""
    command = [sys.executable, str(Path(__file__).resolve()), _INSIDE, str(seconds), str(folder)]
    code = subprocess.run(command, check=False).returncode
    crashes = [path for path in folder.iterdir() if path.is_file()]  # also what took too long or too much memory
    found = len(list((folder / "findings").iterdir())) + len(crashes)
    print(f"parsers: {found} findings, exit {code}", flush=True)
    return found + (code != 0)


def _fuzz(seconds: int, folder: Path) -> None:
    findings, inputs = Findings(folder / "findings"), folder / "inputs"
    inputs.mkdir(parents=True, exist_ok=True)
    for target, data in seeds():
        if len(data) < _LONGEST_INPUT:
            seed = bytes([TARGETS.index(target)]) + data
            (inputs / hashlib.sha256(seed).hexdigest()[:16]).write_bytes(seed)

    def one(data: bytes) -> None:
        if not data:
            return
        try:
            parse(data)
        except GripwrightError:
            pass
        except Exception as error:  # noqa: BLE001 - whatever it is, it is what is looked for
            last = traceback.extract_tb(error.__traceback__)[-1]
            own = [frame for frame in traceback.extract_tb(error.__traceback__) if "gripwright" in frame.filename] or [last]
            findings.add(f"{Path(own[-1].filename).name}:{own[-1].lineno} {type(error).__name__}", data, str(error)[:200])

    options = [
        f"-max_total_time={seconds}",
        f"-max_len={_LONGEST_INPUT}",
        "-timeout=10",
        "-rss_limit_mb=3000",
        "-print_final_stats=1",
    ]
    atheris.Setup([sys.argv[0], *options, f"-artifact_prefix={folder}/", str(inputs)], one)
    atheris.Fuzz()


def fuzz_service(seconds: int, folder: Path) -> int:
    chance, findings, statuses = random.Random(int(time.time())), Findings(folder / "findings"), Counter()
    files = [("step", block()), *((format, data) for format, data in seeds() if format in FORMATS and len(data) < 100_000)]
    requests = [bad for bad in small_corpus() if len(bad.body) < 100_000]
    slowest = 0.0
    with tempfile.TemporaryDirectory(prefix="gripwright-fuzz-") as data, hostile_service(Path(data)) as service:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            batch = [_mutant(chance, files, requests) for _ in range(20)]
            with ThreadPoolExecutor(_AT_A_TIME) as pool:
                for bad, answer in zip(batch, pool.map(service.upload, batch), strict=True):
                    statuses[answer.status] += 1
                    slowest = max(slowest, answer.seconds)
                    if not 200 <= answer.status < 500 or answer.seconds > LONGEST_S:
                        findings.add(f"{bad.kind} {answer.status}", bad.body, f"{answer.seconds:.1f} s {answer.body[:200]!r}")
            if not service.is_alive():
                findings.add("service", b"", "the service or a worker is not alive")
                break
        left, defects = service.leftovers(), service.defects()
    print(f"{sum(statuses.values())} uploads in {seconds} s, slowest {slowest:.2f} s, statuses {dict(statuses)}")
    print(f"left behind: temporary {left['temporary']}, parsers {left['parsers']}, of which one is kept ready")
    print(f"defects in the log: {defects[:5]}")
    return len(findings) + len(left["temporary"]) + abs(left["parsers"] - 1) + len(defects)


def _mutant(chance: random.Random, files, requests) -> BadUpload:
    kind = chance.choice(("file", "file", "package", "request"))
    if kind == "file":
        format, data = chance.choice(files) if chance.random() < 0.8 else files[0]
        return BadUpload(f"mutated {format}", "", package_of(_mutated(chance, data), format))
    if kind == "package":
        package = make_package(make_document(f"F-{chance.getrandbits(40)}"))
        return BadUpload("mutated package", "", alone(_mutated(chance, package)))
    if chance.random() < 0.5:
        bad = chance.choice(requests)
        return BadUpload("mutated request", "", _mutated(chance, bad.body), bad.content_type)
    return BadUpload(
        "mutated request", "", _mutated(chance, form(("manifest", None, _json(document())), ("files", "part.stl", stl())))
    )


def _mutated(chance: random.Random, data: bytes) -> bytes:
    changed = bytearray(data)
    for _ in range(chance.choice((1, 1, 2, 4, 16))):
        if not changed:
            break
        at = chance.randrange(len(changed))
        match chance.randrange(6):
            case 0:
                changed[at] ^= 1 << chance.randrange(8)
            case 1:
                del changed[at:]
            case 2:
                del changed[at : at + chance.randrange(1, 64)]
            case 3:
                changed[at:at] = changed[at : at + chance.randrange(1, 256)] * chance.choice((1, 2, 50))
            case 4:
                changed[at : at + 4] = chance.choice((b"\xff\xff\xff\xff", b"\0\0\0\0", b"\x7f\xff\xff\xff", b"\0\0\xc0\x7f"))
            case _:
                changed[at : at + 3] = chance.choice((b"-1 ", b"nan", b"9e9", b"#1,", b"(((", b"\x00", b"../", b"'"))
    return bytes(changed)


def main() -> None:
    mode, seconds = sys.argv[1] if len(sys.argv) > 1 else "", int(sys.argv[2]) if len(sys.argv) > 2 else _SECONDS
    if mode == _INSIDE:
        _fuzz(seconds, Path(sys.argv[3]))
    found = 0
    for name, fuzz in (("parsers", fuzz_parsers), ("service", fuzz_service)):
        if mode in ("", name):
            folder = Path(tempfile.mkdtemp(prefix=f"gripwright-fuzz-{name}-"))
            print(f"findings are kept in {folder}", flush=True)
            found += fuzz(seconds, folder)
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
