"""A design of a revised product, of which some is remembered, is that of a workshop that remembers nothing."""

import json
import shutil

import pytest
import trimesh

from gripwright.cad.limits import DEFAULT_LIMITS
from gripwright.cad.package import read_package
from gripwright.design import pipeline
from gripwright.design.plan import plan_of
from gripwright.jobs.catalogue import catalogue
from gripwright.jobs.local import LocalRunner
from gripwright.jobs.steps import Workshop
from gripwright.settings import load_settings

PLATE, PEG, BLOCK, POST = "plate", "peg", "block", "post"


def _part(name):
    match name:
        case "plate":
            part = trimesh.creation.box((90.0, 40.0, 8.0))
        case "peg":
            part = trimesh.creation.cylinder(radius=8.0, height=30.0, sections=48)
        case "block":
            part = trimesh.creation.box((20.0, 14.0, 16.0))
        case _:
            part = trimesh.creation.box((10.0, 10.0, 24.0))
    part.apply_translation((0.0, 0.0, part.extents[2] / 2.0))
    return part


PLACES = {PLATE: (0.0, 0.0, 0.0), PEG: (-30.0, 0.0, 8.0), BLOCK: (30.0, 0.0, 8.0), POST: (4.0, 0.0, 8.0)}


@pytest.fixture
def package(tmp_path):
    """A peg, a block and, between them, a post set down on a plate."""
    folder = tmp_path / "package"
    folder.mkdir()
    for name in PLACES:
        _part(name).export(folder / f"{name}.stl")
    _write(folder)
    return folder


def _pose(x, y, z):
    return [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, y], [0.0, 0.0, 1.0, z], [0.0, 0.0, 0.0, 1.0]]


def _write(folder, places=PLACES):
    names = list(places)
    components = [
        {"id": name, "part_number": name, "revision": "A", "file": f"{name}.stl", "units": "mm", "pose": _pose(*place)}
        for name, place in places.items()
    ]
    operations = [
        {
            "id": f"set-{name}",
            "active": [name],
            "passive": names[:number],
            "pose_before": _pose(0.0, 0.0, 120.0),
            "pose_after": _pose(0.0, 0.0, 0.0),
        }
        for number, name in enumerate(names)
    ]
    document = {"part_number": "p", "revision": "A", "name": "Peg, block, post", "components": components}
    (folder / "product.json").write_text(json.dumps({**document, "operations": operations}))


def _stretched(name, *scale):
    def change(folder):
        part = _part(name)
        part.apply_scale(scale)
        part.export(folder / f"{name}.stl")

    return change


def _beside_the_block(folder):
    """The post where the block's fingers had their place."""
    _write(folder, {PLATE: PLACES[PLATE], PEG: PLACES[PEG], POST: (18.0, 0.0, 8.0), BLOCK: PLACES[BLOCK]})


def _files(package, data):
    runner = LocalRunner(Workshop(data_dir=data), plan_of({}))
    task = read_package(package, DEFAULT_LIMITS)
    result = pipeline.design(task, catalogue(load_settings()), runner.plan, runner)
    (folder,) = runner.map("export", [{"result": {"ref": result}}])
    files = runner.get(folder)
    document = json.loads(files["design.json"])
    assert document.pop("timings")
    return {**files, "design.json": document}


def test_what_is_remembered_changes_no_byte_of_a_design(package, tmp_path):
    first = _files(package, tmp_path / "kept")
    changes = {
        "what all stands on grows": _stretched(PLATE, 1.0, 1.0, 1.05),
        "a part grows into the way": _stretched(POST, 2.6, 1.0, 1.0),
        "the order changes, and a place": _beside_the_block,
    }
    for words, change in changes.items():
        change(package)
        again = _files(package, tmp_path / "kept")
        shutil.rmtree(tmp_path / "new", ignore_errors=True)
        cold = _files(package, tmp_path / "new")

        assert again.keys() == cold.keys(), words
        assert [name for name in cold if again[name] != cold[name]] == [], words
        assert cold["design.json"] != first["design.json"], words
