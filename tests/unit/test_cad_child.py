"""The child process that parses: whatever a file does to it, the reader says which file, and reads the next."""

import os
import signal
import struct
import subprocess
import sys
import time

import numpy as np
import psutil
import pytest
import trimesh

from gripwright.cad.export import stl_bytes
from gripwright.cad.limits import Limits
from gripwright.cad.reader import CadReader
from gripwright.domain.errors import InvalidGeometry, LimitExceeded
from gripwright.domain.shape import Mesh
from gripwright.geometry.measures import volume_mm3

BOX = (
    b"".join(b"v %d %d %d\n" % (x, y, z) for x in (0, 10) for y in (0, 10) for z in (0, 10))
    + b"f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"
)


def _large_obj() -> bytes:
    sphere = trimesh.creation.icosphere(subdivisions=6)
    return sphere.export(file_type="obj").encode() * 8


def test_a_file_that_takes_too_long_is_named_and_its_process_ends() -> None:
    with CadReader(Limits(seconds=0.05)) as reader:
        started = time.monotonic()
        with pytest.raises(LimitExceeded, match=r"slow.obj is not read within the 0.05 s"):
            reader.mesh("slow.obj", _large_obj(), "obj", "mm")

        assert time.monotonic() - started < 10


def test_a_file_that_needs_too_much_memory_is_named_and_a_small_one_is_read_in_it() -> None:
    points = np.random.default_rng(0).random((1_500_000, 3)) * 100
    data = stl_bytes(Mesh(vertices_mm=points, faces=np.arange(len(points)).reshape(-1, 3)))

    with CadReader(Limits(memory_bytes=250 * 2**20)) as reader:
        with pytest.raises(LimitExceeded, match=r"^huge.stl needs more memory than allowed"):
            reader.mesh("huge.stl", data, "stl", "mm")

        assert len(reader.mesh("box.obj", BOX, "obj", "mm").faces) == 12


def test_more_triangles_than_allowed_are_refused() -> None:
    with CadReader(Limits(max_triangles=11)) as reader, pytest.raises(LimitExceeded, match="holds 12 triangles, at most 11"):
        reader.mesh("box.obj", BOX, "obj", "mm")


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("noise.ply", b"ply\nformat binary_little_endian 1.0\nelement vertex 99\nproperty float x\nend_header\n123"),
        ("noise.glb", b"glTF" + struct.pack("<II", 2, 40) + b"\xff" * 40),
        ("noise.off", b"OFF\n1000000000 1 0\n0 0 0\n"),
        ("noise.stl", b"\x00" * 80 + struct.pack("<I", 4_000_000_000) + b"\x00" * 50),
        ("noise.step", b"ISO-10303-21;\nDATA;\n#1 = PRODUCT(" + b"(" * 50_000),
    ],
)
def test_a_broken_file_is_refused_with_its_name_and_the_next_one_is_read(name: str, data: bytes) -> None:
    with CadReader(Limits()) as reader:
        with pytest.raises(InvalidGeometry, match=f"^{name} "):
            reader.mesh(name, data, name.partition(".")[2], "mm")

        assert volume_mm3(reader.mesh("box.obj", BOX, "obj", "mm")) == pytest.approx(1000)


def test_a_process_that_is_killed_from_outside_is_reported_and_renewed() -> None:
    others = _children()
    with CadReader(Limits()) as reader:
        reader.mesh("box.obj", BOX, "obj", "mm")
        (child,) = _children() - others
        os.kill(child, signal.SIGKILL)

        with pytest.raises(InvalidGeometry, match=r"box.obj ends the process that reads it \(SIGKILL\)"):
            reader.mesh("box.obj", BOX, "obj", "mm")
        assert len(reader.mesh("box.obj", BOX, "obj", "mm").faces) == 12


def test_the_process_ends_with_its_parent() -> None:
    script = (
        "import os, psutil, signal\n"
        "from gripwright.cad.limits import Limits\n"
        "from gripwright.cad.reader import CadReader\n"
        f"reader = CadReader(Limits()); reader.mesh('box.obj', {BOX!r}, 'obj', 'mm')\n"
        "print(*(child.pid for child in psutil.Process().children()), flush=True)\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    child = int(subprocess.run([sys.executable, "-c", script], stdout=subprocess.PIPE, check=False).stdout)

    for _ in range(100):
        if not _alive(child):
            break
        time.sleep(0.05)
    assert not _alive(child)


def test_nothing_is_left_behind() -> None:
    others = _children()

    with CadReader(Limits()) as reader:
        reader.mesh("box.obj", BOX, "obj", "mm")

    assert _children() <= others


def _children() -> set[int]:
    """Processes that parse, of this one; a service that another test has started keeps one ready."""
    return {child.pid for child in psutil.Process().children() if "gripwright.cad.child" in " ".join(child.cmdline())}


def _alive(process: int) -> bool:
    return psutil.pid_exists(process) and psutil.Process(process).status() != psutil.STATUS_ZOMBIE
