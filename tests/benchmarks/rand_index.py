"""How far segmentations are from those of people: 1 − Rand index over folders in the Princeton benchmark's format.

usage: python tests/benchmarks/rand_index.py FOLDER [--set key=value …]

FOLDER holds meshes `NAME.off` and, beside them or in folders below, segmentations `NAME.seg` or `NAME_anything.seg` with one
label a face a line, several a mesh. Prints one line a mesh and the mean over all segmentations, 0 for agreement.
"""

import argparse
import json
from pathlib import Path

import numpy as np

from gripwright.design.stages.prepare import PrepareSettings, prepare
from gripwright.design.stages.segment import segment, source_labels
from gripwright.domain.assembly import IDENTITY, Component
from gripwright.domain.errors import GripwrightError, InvalidGeometry, Rejection
from gripwright.domain.shape import IntArray, Mesh
from gripwright.plugin_api import RunContext
from gripwright_builtin.segmenters.sdf import SdfSegmenter


def read_off(path: Path) -> Mesh:
    """A mesh in the OFF format; faces of more than three corners are refused."""
    words = [word for line in path.read_text().splitlines() for word in line.split("#")[0].split()]
    if words[0] == "OFF":
        words = words[1:]
    n, m = int(words[0]), int(words[1])
    numbers = words[3:]
    vertices = np.array(numbers[: 3 * n], dtype=np.float64).reshape(n, 3)
    faces = np.array(numbers[3 * n : 3 * n + 4 * m], dtype=np.int64).reshape(m, 4)
    if (faces[:, 0] != 3).any():
        raise SystemExit(f"{path.name}: not a triangle mesh")
    return Mesh(vertices_mm=vertices, faces=faces[:, 1:])


def labels_of(mesh: Mesh, settings: SdfSegmenter.Settings) -> IntArray:
    """Segment number of each face of the file; `GripwrightError` where it is refused."""
    prepared = prepare(mesh, PrepareSettings(), RunContext()).mesh
    component = Component(id="mesh", mesh=prepared, X_PC=IDENTITY)
    segments = segment(component, SdfSegmenter(settings), RunContext())
    if isinstance(segments, Rejection):
        raise InvalidGeometry(segments.detail)
    return source_labels(prepared, segments, len(mesh.faces))


def found_or_whole(path: Path, settings: SdfSegmenter.Settings) -> tuple[IntArray, str | None]:
    """Labels of a mesh file, and why it is refused; a refused mesh counts as one segment."""
    mesh = read_off(path)
    try:
        return labels_of(mesh, settings), None
    except GripwrightError as refusal:
        return np.zeros(len(mesh.faces), dtype=np.int64), refusal.detail


def rand_index(first: IntArray, second: IntArray) -> float:
    """Fraction of the pairs of faces about which two labellings agree: same segment or different ones."""
    table = np.zeros((int(first.max()) + 1, int(second.max()) + 1))
    np.add.at(table, (first, second), 1.0)
    pairs = [float((counts * (counts - 1)).sum()) / 2 for counts in (table, table.sum(axis=0), table.sum(axis=1))]
    total = len(first) * (len(first) - 1) / 2
    return 1.0 + (2.0 * pairs[0] - pairs[1] - pairs[2]) / total


def segmentations_by_mesh(folder: Path) -> dict[Path, list[Path]]:
    """The .seg files of each .off file."""
    found = sorted(folder.rglob("*.seg"))
    return {
        mesh: [seg for seg in found if seg.stem == mesh.stem or seg.stem.startswith(f"{mesh.stem}_")]
        for mesh in sorted(folder.rglob("*.off"))
    }


def main() -> None:
    """Print the distances."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="parameter of the segmenter")
    arguments = parser.parse_args()
    settings = SdfSegmenter.Settings.model_validate(dict(item.split("=", 1) for item in arguments.set))
    distances: list[float] = []
    for path, segmentations in segmentations_by_mesh(arguments.folder).items():
        found, refusal = found_or_whole(path, settings)
        humans = [np.unique(np.loadtxt(seg, dtype=np.int64), return_inverse=True)[1] for seg in segmentations]
        here = [1.0 - rand_index(found, human) for human in humans]
        distances += here
        line = {"mesh": path.stem, "segments": int(found.max()) + 1, "distance": float(np.mean(here)) if here else None}
        print(json.dumps(line | ({"refused": refusal} if refusal else {})), flush=True)
    print(json.dumps({"segmentations": len(distances), "mean": float(np.mean(distances)) if distances else None}))


if __name__ == "__main__":
    main()
