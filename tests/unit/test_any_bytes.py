"""Whatever bytes are called a CAD file, they are a mesh that can be computed on, or refused with a reason."""

import contextlib
import io
import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from gripwright.cad.colour import component_glb
from gripwright.cad.export import stl_bytes, threemf_bytes
from gripwright.cad.limits import Limits
from gripwright.cad.package import read_package
from gripwright.cad.read import read_mesh
from gripwright.cad.reader import CadReader
from gripwright.domain.errors import GripwrightError, LimitExceeded
from gripwright.geometry.measures import volume_mm3
from gripwright.settings import Settings
from service_factory import make_wedge

_MIB = 2**20
_WEDGE = make_wedge()
_TRIMESH = trimesh.Trimesh(_WEDGE.vertices_mm, _WEDGE.faces, process=False)


def _exported(format, **options):
    data = _TRIMESH.export(file_type=format, **options)
    return data.encode() if isinstance(data, str) else data


SOUND = {
    "stl": [stl_bytes(_WEDGE), _exported("stl_ascii")],
    "obj": [_exported("obj")],
    "off": [_exported("off")],
    "ply": [_exported("ply"), _exported("ply", encoding="ascii")],
    "glb": [component_glb("wedge", _WEDGE), _exported("glb")],
    "3mf": [threemf_bytes(_WEDGE, "wedge"), _exported("3mf")],
}
EDITS = st.lists(st.tuples(st.integers(0, 4000), st.integers(0, 40), st.binary(max_size=12)), min_size=1, max_size=4)


def _edited(data, edits):
    """The data with stretches of it replaced: place, length, and what comes there."""
    changed = bytearray(data)
    for place, length, bytes_ in edits:
        at = place % (len(changed) + 1)
        changed[at : at + length] = bytes_
    return bytes(changed)


@pytest.mark.parametrize("format", SOUND)
@settings(max_examples=60, deadline=None)
@given(choice=st.data())
def test_any_bytes_are_a_valid_mesh_or_refused(format, choice):
    noise = st.binary(max_size=300)
    data = choice.draw(noise | st.builds(_edited, st.sampled_from(SOUND[format]), EDITS))
    units = None if format in ("glb", "3mf") else "mm"

    mesh = None
    with contextlib.suppress(GripwrightError):
        mesh = read_mesh(data, format, units, Limits(max_triangles=1000, max_instances=1000))

    if mesh is not None:
        assert np.isfinite(mesh.vertices_mm).all()
        assert mesh.faces.min() >= 0
        assert mesh.faces.max() < len(mesh.vertices_mm)


@pytest.mark.parametrize("format", SOUND)
def test_every_sound_file_is_the_same_wedge(format):
    for data in SOUND[format]:
        mesh = read_mesh(data, format, "mm", Limits())

        assert trimesh.Trimesh(mesh.vertices_mm, mesh.faces, process=False).is_watertight
        scale = 1000 if data is SOUND["glb"][0] else 1  # written in metres
        assert volume_mm3(mesh) * scale**3 == pytest.approx(_TRIMESH.volume, rel=1e-5)


@pytest.mark.parametrize("format", ["stl", "step", "glb"])
def test_what_any_bytes_make_of_the_process_that_reads_them_it_keeps_to_its_memory(format):
    limits = Limits(memory_bytes=1500 * _MIB)
    random = np.random.default_rng(4)

    with CadReader(limits) as reader:
        for _ in range(3):
            data = b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n" + random.bytes(2000) + b"END-ISO-10303-21;"
            with pytest.raises(GripwrightError, match=f"^part.{format} "):
                reader.mesh(f"part.{format}", data, format, "mm")


def test_the_time_of_a_file_grows_with_its_size_and_hanging_small_ones_are_refused_first():
    limits = Limits(seconds_per_file=0.01, seconds_per_mebibyte=0.0)

    assert Limits(seconds_per_file=7, seconds_per_mebibyte=4).seconds_for(3 * _MIB) == pytest.approx(19)
    with (
        CadReader(limits) as reader,
        pytest.raises(LimitExceeded, match=r"not read within the 0\.0 s of processor time that its size allows"),
    ):
        reader.mesh("part.obj", b"v 1 2 3\n" * 100_000, "obj", "mm")


def test_after_some_files_that_end_their_process_the_rest_is_not_read():
    crash = b"ISO-10303-21;\nDATA;\n#1 = PRODUCT(" + b"(" * 50_000 + b"END-ISO-10303-21;"

    with CadReader(Limits(max_crashes=1, seconds_per_file=0.001)) as reader:
        with pytest.raises(LimitExceeded, match="not read within"):
            reader.mesh("a.step", crash, "step", None)
        with pytest.raises(LimitExceeded, match=r"b\.step is not read: 1 files before it ended the process"):
            reader.mesh("b.step", crash, "step", None)


def test_the_limits_of_packages_are_settings(monkeypatch, tmp_path: Path):
    for name, value in (("PACKAGE_MAX_FILES", 1), ("PARSE_FILE_S", 2.5), ("PARSE_MEMORY_MB", 1024)):
        monkeypatch.setenv(f"GRIPWRIGHT_{name}", str(value))
    package = tmp_path / "p.zip"
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as archive:
        archive.writestr("product.json", json.dumps({}))
        archive.writestr("part.stl", stl_bytes(_WEDGE))
    package.write_bytes(data.getvalue())

    limits = Settings(data_dir=tmp_path).package_limits

    assert (limits.seconds_per_file, limits.memory_bytes) == (2.5, 1024 * _MIB)
    with pytest.raises(LimitExceeded, match=r"p\.zip holds 2 files, at most 1"):
        read_package(package, limits)
