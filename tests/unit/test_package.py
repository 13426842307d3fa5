"""Product packages: what a good one becomes, and every fault of a bad one at its place."""

import contextlib
import json
import os
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gripwright.cad.archive import open_archive
from gripwright.cad.export import step_bytes, stl_bytes
from gripwright.cad.limits import Limits
from gripwright.cad.manifest import read_manifest
from gripwright.cad.operations import validate_operations
from gripwright.cad.package import read_package
from gripwright.domain.assembly import AssemblyTask
from gripwright.domain.errors import InvalidInput, LimitExceeded
from gripwright.domain.shape import Mesh
from gripwright.geometry.brep import box, write_brep
from gripwright.geometry.measures import face_areas_mm2, volume_mm3

IDENTITY = np.eye(4).tolist()
SHARED = Path(__file__).parents[3] / "shared" / "data"


def _raised(height: float, turn_deg: float = 0.0) -> list[list[float]]:
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    return [[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, height], [0, 0, 0, 1]]


def _wedge(size: float = 10.0) -> Mesh:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]) * size
    return Mesh(vertices_mm=vertices, faces=np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]))


def _component(id_: str, **fields: Any) -> dict[str, Any]:
    return {"id": id_, "part_number": f"P-{id_}", "revision": "A", "file": "wedge.stl", "units": "mm", "pose": IDENTITY, **fields}


def _operation(id_: str, active: list[str], passive: list[str], **fields: Any) -> dict[str, Any]:
    poses = {"pose_before": _raised(50), "pose_after": IDENTITY}
    return {"id": id_, "active": active, "passive": passive, **poses, **fields}


def _document() -> dict[str, Any]:
    document = {
        "part_number": "CP-1",
        "revision": "B",
        "name": "Pump",
        "components": [_component("base"), _component("rotor"), _component("cover"), _component("cap", file="cap.stl")],
        "environment": [{"id": "fixture", "file": "wedge.stl", "units": "cm", "operations": ["op-1"]}],
        "operations": [
            _operation("op-1", ["rotor"], ["base"], waypoints=[_raised(20, 90)], force=20, fit="clearance"),
            _operation("op-2", ["cover"], ["base", "rotor"]),
        ],
    }
    return json.loads(json.dumps(document))  # its entries share no pose any more


FILES = {"wedge.stl": stl_bytes(_wedge()), "cap.stl": stl_bytes(_wedge(5.0))}


def _folder(path: Path, document: Any, files: dict[str, bytes] = FILES) -> Path:
    path.mkdir(exist_ok=True)
    text = document if isinstance(document, str) else json.dumps(document)
    for name, data in {"product.json": text.encode(), **files}.items():
        (path / name).write_bytes(data)
    return path


def _zip(path: Path, document: dict[str, Any], prefix: str = "", files: dict[str, bytes] = FILES) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in {"product.json": json.dumps(document).encode(), **files}.items():
            archive.writestr(prefix + name, data)
    return path


def _faults(path: Path, **arguments: Any) -> dict[str, str]:
    with pytest.raises(InvalidInput) as caught:
        read_package(path, **arguments)
    return {fault.pointer: fault.message for fault in caught.value.faults}


def _check(task: AssemblyTask) -> None:
    assert (task.part_number, task.revision, task.name) == ("CP-1", "B", "Pump")
    assert [component.id for component in task.components] == ["base", "rotor", "cover", "cap"]
    assert volume_mm3(task.component("rotor").mesh) == pytest.approx(1000 / 6)
    assert task.component("rotor").mesh is task.component("base").mesh
    assert volume_mm3(task.component("cap").mesh) == pytest.approx(125 / 6)
    assert volume_mm3(task.obstacles[0].mesh) == pytest.approx(1e6 / 6)
    assert task.obstacles[0].operations == ("op-1",)
    first = task.operations[0]
    assert (first.active, first.passive, first.force_N, first.fit) == (("rotor",), ("base",), 20.0, "clearance")
    assert first.motion == pytest.approx(np.array([_raised(50), _raised(20, 90), IDENTITY]))
    assert task.warnings == ()


def test_the_reading_process_alone_imports_mesh_libraries() -> None:
    script = "import sys, gripwright.cad.package, gripwright.cad.colour; print(*{'OCP', 'trimesh', 'scipy'} & set(sys.modules))"

    assert subprocess.run([sys.executable, "-c", script], stdout=subprocess.PIPE, check=True).stdout.strip() == b""


def test_a_folder_becomes_an_assembly_task(tmp_path: Path) -> None:
    _check(read_package(_folder(tmp_path / "pump", _document())))


@pytest.mark.parametrize("prefix", ["", "pump-v2/"])
def test_a_zip_becomes_the_same_task_with_or_without_a_folder_in_it(tmp_path: Path, prefix: str) -> None:
    _check(read_package(_zip(tmp_path / "pump.zip", _document(), prefix)))


def test_regions_and_material_reach_the_component(tmp_path: Path) -> None:
    document = _document()
    document["components"][1] |= {
        "density": 2700,
        "friction": 0.4,
        "no_grasp": [{"reason": "teeth", "box": {"min": [0, 0, 0], "max": [1, 2, 3]}}],
        "may_grasp": [{"reason": "hub", "segments": [2, 3]}],
    }

    rotor = read_package(_folder(tmp_path / "p", document)).component("rotor")

    assert (rotor.density_kg_m3, rotor.friction) == (2700, 0.4)
    assert rotor.no_grasp[0].reason == "teeth"
    assert rotor.no_grasp[0].box_max_C == pytest.approx([1, 2, 3])
    assert rotor.may_grasp[0].segments == (2, 3)


def test_a_pose_rounded_to_five_digits_is_the_nearest_rotation(tmp_path: Path) -> None:
    document = _document()
    document["components"][0]["pose"] = [[0.70711, -0.70711, 0, 1], [0.70711, 0.70711, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]

    X = read_package(_folder(tmp_path / "p", document)).component("base").X_PC

    assert X[:3, :3] @ X[:3, :3].T == pytest.approx(np.eye(3), abs=1e-12)
    assert X[:3, 3] == pytest.approx([1, 2, 3])


def test_operations_given_apart_replace_those_of_the_document(tmp_path: Path) -> None:
    package = _folder(tmp_path / "p", _document())
    apart = tmp_path / "operations.json"
    apart.write_text(json.dumps({"operations": [_operation("only", ["cover"], ["base"])]}))
    document = _document() | {"environment": []}

    task = read_package(_folder(tmp_path / "q", document), operations=apart)

    assert [operation.id for operation in task.operations] == ["only"]
    assert _faults(package, operations=apart) == {"/environment/0/operations/0": "unknown operation 'op-1'"}


def test_an_operation_that_ends_beside_the_place_is_a_warning(tmp_path: Path) -> None:
    document = _document()
    document["operations"][1]["pose_after"] = _raised(2)

    assert "'cover' beside its place" in read_package(_folder(tmp_path / "p", document)).warnings[0]


def _set(document: Any, pointer: str, value: Any) -> None:
    *steps, last = [int(step) if step.isdigit() else step for step in pointer.split("/")[1:]]
    for step in steps:
        document = document[step]
    document[last] = value


@pytest.mark.parametrize(
    ("change", "value", "at", "says"),
    [
        ("/components/3/file", "../cap.stl", "/components/3/file", "stay inside the package"),
        ("/components/3/file", "/etc/cap.stl", "/components/3/file", "stay inside the package"),
        ("/components/3/file", "..\\cap.stl", "/components/3/file", "stay inside the package"),
        ("/components/3/file", "C:cap.stl", "/components/3/file", "stay inside the package"),
        ("/components/3/file", "cap.doc", "/components/3/file", "not a format that is read"),
        ("/components/3/units", None, "/components/3/units", "units absent"),
        ("/components/3/units", "furlong", "/components/3/units", "'mm', 'cm', 'm' or 'in'"),
        ("/components/3/id", "rotor", "/components/3/id", "given twice"),
        ("/components/3/id", "a/b", "/components/3/id", "not an id"),
        ("/components/3/pose", np.diag([1.0, 1, -1, 1]).tolist(), "/components/3/pose", "determinant is -1"),
        ("/components/3/pose", np.diag([2.0, 1, 1, 1]).tolist(), "/components/3/pose", "by 3, at most 0.0001"),
        ("/components/3/pose/3", [0, 0, 0, 2], "/components/3/pose", "last row"),
        ("/components/3/pose/0/3", 1e9, "/components/3/pose", "translation of more than"),
        ("/components/3/pose", [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "/components/3/pose/3", "absent"),
        ("/components/3/pose/1/1", "1", "/components/3/pose/1/1", "valid number"),
        ("/components/3/pose/1/1", True, "/components/3/pose/1/1", "valid number"),
        ("/components/3/density", 0, "/components/3/density", "greater than 0"),
        ("/components/3/friction", -0.1, "/components/3/friction", "greater than 0"),
        ("/components/3/wheight", 3, "/components/3/wheight", "unknown field"),
        ("/components/3/no_grasp", [{"reason": "x"}], "/components/3/no_grasp/0", "exactly one of box and segments"),
        (
            "/components/3/no_grasp",
            [{"box": {"min": [1, 0, 0], "max": [0, 0, 0]}}],
            "/components/3/no_grasp/0/box",
            "min exceeds max",
        ),
        ("/components", [], "/components", "at least 1 needed, 0 given"),
        ("/components", {}, "/components", "must be a list"),
        ("/part_number", 7, "/part_number", "valid string"),
        ("/part_number", "CP\0", "/part_number", "control characters"),
        ("/part_number", " ", "/part_number", "blank"),
        ("/environment/0/units", None, "/environment/0/units", "units absent"),
        ("/environment/0/operations", ["op-9"], "/environment/0/operations/0", "unknown operation 'op-9'"),
        ("/operations/1/active/0", "ghost", "/operations/1/active/0", "unknown component 'ghost'"),
        ("/operations/1/passive/1", "ghost", "/operations/1/passive/1", "unknown component 'ghost'"),
        ("/operations/1/passive/1", "base", "/operations/1/passive/1", "named twice"),
        ("/operations/1/passive/1", "cover", "/operations/1/passive/1", "named twice"),
        ("/operations/1/active", [], "/operations/1/active", "at least 1 needed, 0 given"),
        ("/operations/0/passive/0", "cover", "/operations/0/passive/0", "'cover' is not in its place yet: operation 'op-2'"),
        ("/operations/1/active/0", "rotor", "/operations/1/active/0", "moved twice: operation 'op-1'"),
        ("/operations/1/id", "op-1", "/operations/1/id", "given twice"),
        ("/operations/1/grasp", "rotor", "/operations/1/grasp", "not one of the active"),
        ("/operations/1/force", -1, "/operations/1/force", "greater than or equal to 0"),
        ("/operations/1/pose_before", _raised(50, 180), "/operations/1/pose_after", "180.0°"),
        ("/operations/0/waypoints/0", _raised(20, 180), "/operations/0/waypoints/0", "less than 180° a step"),
        ("/operations/0/waypoints/0/0/0", 7, "/operations/0/waypoints/0", "not a rigid pose"),
    ],
)
def test_a_fault_is_named_by_its_pointer(change: str, value: Any, at: str, says: str) -> None:
    document = _document()
    _set(document, change, value)

    with pytest.raises(InvalidInput) as caught:
        read_manifest(json.dumps(document).encode())

    faults = {fault.pointer: fault.message for fault in caught.value.faults}
    assert at in faults
    assert says in faults[at]


def test_all_faults_of_document_sequence_and_files_come_together(tmp_path: Path) -> None:
    document = _document()
    document["components"][0]["pose"][0][0] = 3
    document["components"][3]["file"] = "gone.stl"
    document["components"].append(_component("bad", file="bad.obj"))
    document["operations"][1]["active"] = ["ghost"]

    faults = _faults(_folder(tmp_path / "p", document, {**FILES, "bad.obj": b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"}))

    assert set(faults) == {"/components/0/pose", "/components/3/file", "/components/4/file", "/operations/1/active/0"}
    assert "bad.obj holds 1 vertices whose coordinates are not numbers" in faults["/components/4/file"]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('{"part_number": "x",\n  oops}', "line 2, column 3"),
        ('{"part_number": NaN}', "NaN is no number"),
        ('{"components": [{"density": -Infinity}]}', "-Infinity is no number"),
        ('{"part_number": "x", "part_number": "y"}', "'part_number' is given twice"),
        ("[" * 100_000, "nested more than 1000 levels deep"),
        ("9" * 10_000, "not valid JSON"),
        ('{"name": "\\ud800"}', "surrogates not allowed"),
        ("", "line 1, column 1"),
    ],
)
def test_what_is_no_json_is_refused_with_its_place(tmp_path: Path, text: str, says: str) -> None:
    assert says in _faults(_folder(tmp_path / "p", text))["product.json"]


def test_a_number_too_large_for_a_float_is_refused() -> None:
    document = json.dumps(_document()).replace('"force": 20', '"force": 1e999')

    with pytest.raises(InvalidInput) as caught:
        read_manifest(document.encode())

    assert [fault.pointer for fault in caught.value.faults] == ["/operations/0/force"]


@pytest.mark.parametrize("document", ["[]", "3", "null", '"x"'])
def test_a_document_that_is_no_object_is_refused(document: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        read_manifest(document.encode())

    assert caught.value.faults[0].message == "must be an object"


def test_a_subassembly_may_be_built_first_and_moved_as_a_whole_later() -> None:
    ids = ["base", "rotor", "cover"]
    operations = [
        _operation("op-1", ["rotor"], []),
        _operation("op-2", ["cover"], ["rotor"]),
        _operation("op-3", ["rotor", "cover"], ["base"], grasp="rotor"),
    ]

    assert [entry.id for entry in validate_operations({"operations": operations}, ids)] == ["op-1", "op-2", "op-3"]
    with pytest.raises(InvalidInput, match="sequence") as caught:
        validate_operations([*operations[:2], _operation("op-3", ["rotor"], ["base"])], ids)
    assert caught.value.faults[0].pointer == "/operations/2/active/0"
    assert "joined with 'cover', which would be left behind" in caught.value.faults[0].message


def test_setting_down_twice_is_a_component_moved_twice() -> None:
    with pytest.raises(InvalidInput) as caught:
        validate_operations([_operation("op-1", ["rotor"], []), _operation("op-2", ["rotor"], [])], ["rotor"])

    assert [fault.pointer for fault in caught.value.faults] == ["/operations/1/active/0"]


def _archive_with(path: Path, entry: zipfile.ZipInfo | str, data: bytes = b"x") -> Path:
    _zip(path, _document())
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(entry, data)
    return path


def _link() -> zipfile.ZipInfo:
    entry = zipfile.ZipInfo("link.stl")
    entry.external_attr = 0o120777 << 16
    return entry


@pytest.mark.parametrize(
    ("entry", "says"),
    [
        ("../outside.stl", "leads out"),
        ("/absolute.stl", "leads out"),
        ("a\\..\\b.stl", "leads out"),
        (_link(), "symbolic link"),
        ("inner.zip", "an archive inside"),
        ("wedge.stl", "given twice"),
    ],
)
@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_an_archive_with_a_dangerous_entry_is_refused(tmp_path: Path, entry: zipfile.ZipInfo | str, says: str) -> None:
    name = entry if isinstance(entry, str) else entry.filename

    assert says in _faults(_archive_with(tmp_path / "p.zip", entry))[name]


@pytest.mark.parametrize(
    ("build", "limits"),
    [
        (lambda path: _archive_with(path, "bomb.stl", b"\0" * 3_000_000), Limits()),
        (lambda path: _archive_with(path, "large.stl", os.urandom(20_000)), Limits(max_file_bytes=10_000)),
        (lambda path: _archive_with(path, "large.stl", os.urandom(20_000)), Limits(max_total_bytes=15_000)),
        (lambda path: _zip(path, _document()), Limits(max_files=2)),
        (lambda path: _zip(path, _document()), Limits(max_document_bytes=100)),
        (lambda path: _zip(path, _document()), Limits(max_triangles=3)),
        (lambda path: _folder(path, _document()), Limits(max_files=2)),
        (lambda path: _folder(path, _document()), Limits(max_file_bytes=100)),
        (lambda path: _folder(path, _document()), Limits(max_total_bytes=1500)),
    ],
)
def test_what_exceeds_a_limit_is_refused(tmp_path: Path, build: Callable[[Path], Path], limits: Limits) -> None:
    with pytest.raises(LimitExceeded):
        read_package(build(tmp_path / "p.zip"), limits)


def test_an_archive_whose_directory_lies_about_sizes_is_refused(tmp_path: Path) -> None:
    path, size = tmp_path / "p.zip", 1_000_003
    _zip(path, _document(), files={**FILES, "cap.stl": b"\0" * size})
    path.write_bytes(path.read_bytes().replace(size.to_bytes(4, "little"), (100).to_bytes(4, "little")))

    assert "cannot be decompressed" in _faults(path)["/components/3/file"]


def test_a_damaged_archive_is_read_or_refused_but_never_a_defect(tmp_path: Path) -> None:
    data, random = _zip(tmp_path / "p.zip", _document()).read_bytes(), np.random.default_rng(5)

    for _ in range(500):
        damaged = np.frombuffer(data, np.uint8).copy()
        damaged[random.integers(len(data), size=3)] = random.integers(256, size=3)
        with contextlib.suppress(InvalidInput, LimitExceeded):
            files = open_archive(damaged.tobytes(), "p.zip", Limits())
            for name in files.names:
                with contextlib.suppress(InvalidInput, LimitExceeded):
                    files.read(name)


ANY_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)
PLACES = [
    "/components", "/components/0", "/components/1/id", "/components/1/file", "/components/1/pose", "/components/1/pose/2",
    "/components/1/no_grasp", "/environment", "/environment/0", "/environment/0/operations", "/operations", "/operations/0",
    "/operations/1/active", "/operations/1/passive/1", "/operations/1/grasp", "/operations/0/waypoints",
    "/operations/0/pose_after", "/name", "/components/1/units",
]  # fmt: skip


@given(place=st.sampled_from(PLACES), value=ANY_JSON)
def test_whatever_stands_anywhere_in_the_document_it_is_taken_or_refused_but_never_a_defect(place: str, value: Any) -> None:
    document = _document()
    _set(document, place, value)

    with contextlib.suppress(InvalidInput):
        read_manifest(json.dumps(document).encode())
    with contextlib.suppress(InvalidInput):
        validate_operations(value, ["base"])


@pytest.mark.parametrize("data", [b"", b"PK\x03\x04garbage", b"\0" * 1000])
def test_what_is_no_archive_is_refused(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "p.zip"
    path.write_bytes(data)

    assert "no zip archive" in _faults(path)["p.zip"]


def test_a_path_that_does_not_exist_and_a_folder_without_document_are_refused(tmp_path: Path) -> None:
    assert "no such" in _faults(tmp_path / "none")["none"]
    assert "no product.json" in _faults(tmp_path)["product.json"]


def test_a_link_out_of_the_folder_is_no_file_of_the_package(tmp_path: Path) -> None:
    (tmp_path / "secret.stl").write_bytes(FILES["cap.stl"])
    package = _folder(tmp_path / "p", _document(), {"wedge.stl": FILES["wedge.stl"]})
    (package / "cap.stl").symlink_to(tmp_path / "secret.stl")

    assert _faults(package) == {"/components/3/file": "no file 'cap.stl' in the package"}


def test_a_lone_step_file_is_a_product_of_its_parts(tmp_path: Path) -> None:
    path = tmp_path / "block.stp"
    path.write_bytes(step_bytes(write_brep(box((0, 0, 0), (10, 20, 30))), name="Block ü", part_number="B-1"))

    task = read_package(path)

    assert [component.id for component in task.components] == ["block-ü"]
    assert volume_mm3(task.components[0].mesh) == pytest.approx(6000)


def test_the_faces_of_step_files_reach_the_task_and_those_of_no_others(tmp_path: Path) -> None:
    block = step_bytes(write_brep(box((0, 0, 0), (10, 20, 30))), name="block", part_number="B-1")
    document = {**_document(), "components": [_component("base", file="base.step"), *_document()["components"][1:]]}

    task = read_package(_zip(tmp_path / "package.zip", document, files={**FILES, "base.step": block}))

    base, rotor = task.component("base").mesh, task.component("rotor").mesh
    assert rotor.cad_faces is None
    assert base.cad_faces is not None
    assert np.bincount(base.cad_faces, weights=face_areas_mm2(base)) == pytest.approx([600, 600, 300, 300, 200, 200])


def test_a_lone_step_assembly_has_the_names_and_poses_of_its_structure() -> None:
    folder = SHARED / "as1"
    if not folder.exists():
        assert os.environ.get("CI") != "true", f"{folder} is missing"
        pytest.skip(f"{folder} is missing")
    described = json.loads((folder / "product.json").read_text())

    task = read_package(folder / "as1.stp", operations=folder / "product.json")

    assert len(task.components) == 18
    meshes = {id(component.mesh): component.mesh for component in task.components}
    assert len(meshes) == 5
    # the half cylinders of its bores are one
    assert sorted(len(np.unique(mesh.cad_faces)) for mesh in meshes.values()) == [3, 5, 7, 12, 12]
    assert [component.id for component in task.components] == [entry["id"] for entry in described["components"]]
    poses = np.array([entry["pose"] for entry in described["components"]])
    assert np.array([component.X_PC for component in task.components]) == pytest.approx(poses, abs=1e-9)
    assert len(task.operations) == 18
    rod = read_package(folder).component("rod-assembly-1-rod-1")
    assert volume_mm3(task.component(rod.id).mesh) == pytest.approx(volume_mm3(rod.mesh), rel=0.02)
