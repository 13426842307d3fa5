"""Segmentation against CGAL's, phases apart, both in the same run: `python tests/benchmarks/bench_segmentation.py [--faces N …]`.

Needs ../shared/bench/cgal_sdf and ../shared/data. Prints one line of JSON a mesh: seconds of each phase, how many times
CGAL's time, the rank correlation of the shape diameters, and the number of segments of either.
"""

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import trimesh
from scipy.stats import spearmanr

from gripwright.design.stages.prepare import PrepareSettings, prepare
from gripwright.design.stages.segment import segment
from gripwright.domain.assembly import IDENTITY, Component
from gripwright.domain.shape import FloatArray, Mesh
from gripwright.geometry.measures import diagonal_mm
from gripwright.geometry.mesh_repair import repaired
from gripwright.geometry.refine import refine, refined_face_count
from gripwright.plugin_api import RunContext
from gripwright_builtin.segmenters.sdf import SdfSegmenter
from gripwright_builtin.segmenters.surface import surface_of

SHARED = Path(__file__).resolve().parents[3] / "shared"
RAYS, CLUSTERS, SMOOTHNESS = 30, 5, 0.26
MESHES = ("as1/l-bracket.stl", "as1/bolt.stl", "industreal-gears/gear-base.stl", "bolt-nut-m16/bolt-m16.stl")
RAW = ("industreal-gears/gear-large.stl",)


def load(name: str) -> Mesh:
    """A mesh of the shared data, as in its file."""
    file = trimesh.load(SHARED / "data" / name, process=False)
    return Mesh(vertices_mm=np.array(file.vertices, dtype=np.float64), faces=np.array(file.faces, dtype=np.int64))


def refined_to(mesh: Mesh, count: int) -> Mesh:
    """The solid with about `count` faces."""
    solid = repaired(mesh)
    low, high = 1e-3, 0.5
    for _ in range(12):
        middle = np.sqrt(low * high) * diagonal_mm(solid)
        fits = refined_face_count(solid, middle) < 2 * count and len(refine(solid, middle).faces) <= 1.1 * count
        low, high = (low, middle / diagonal_mm(solid)) if fits else (middle / diagonal_mm(solid), high)
    fine = refine(solid, high * diagonal_mm(solid))
    return Mesh(vertices_mm=fine.vertices_mm, faces=fine.faces)


def ours(mesh: Mesh) -> tuple[dict[str, float], int]:
    """Seconds of each phase and the number of segments."""
    ctx = RunContext()
    prepared = prepare(mesh, PrepareSettings(), ctx).mesh
    segments = segment(Component(id="mesh", mesh=prepared, X_PC=IDENTITY), SdfSegmenter(SdfSegmenter.Settings()), ctx)
    return ctx.timings, len(segments)


def cgal(mesh: Mesh, exact: bool) -> tuple[dict[str, float], FloatArray]:
    """CGAL's line of JSON and its shape diameters."""
    with tempfile.TemporaryDirectory() as folder:
        path, labels = Path(folder) / "mesh.off", Path(folder) / "labels.txt"
        trimesh.Trimesh(mesh.vertices_mm, mesh.faces, process=False).export(path)
        command = [str(SHARED / "bench" / "cgal_sdf"), *(["--exact"] if exact else []), str(path)]
        command += [str(RAYS), str(CLUSTERS), str(SMOOTHNESS), str(labels)]
        line = subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip().splitlines()[-1]
        return json.loads(line), np.loadtxt(labels)[:, 1]


def compare(name: str, mesh: Mesh, exact: bool) -> dict[str, object]:
    """One line of the table."""
    timings, segments = ours(mesh)
    theirs, diameters = cgal(mesh, exact)
    found = SdfSegmenter(SdfSegmenter.Settings()).shape_diameters_mm(mesh, surface_of(mesh), RunContext())
    total = sum(timings.values())
    return {
        "mesh": name,
        "faces": len(mesh.faces),
        "seconds": round(total, 3),
        "cgal_seconds": theirs["total_s"],
        "times_cgal": round(theirs["total_s"] / total, 1),
        "spearman": round(float(spearmanr(found, diameters)[0]), 4),
        "segments": segments,
        "cgal_segments": theirs["segments"],
        "phases": {key: round(value, 3) for key, value in timings.items()},
    }


def main() -> None:
    """Warm up, then one line a mesh."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--faces", type=int, nargs="*", default=[50_000, 200_000])
    parser.add_argument("--exact", action="store_true", help="let CGAL reach its energy's optimum")
    arguments = parser.parse_args()
    ours(load(MESHES[0]))
    for name in RAW:
        print(json.dumps(compare(name, repaired(load(name)), arguments.exact)), flush=True)
    for count in arguments.faces:
        for name in MESHES:
            print(json.dumps(compare(name, refined_to(load(name), count), arguments.exact)), flush=True)


if __name__ == "__main__":
    main()
