"""Whether one solid meshed differently gives the same segments: Rand indices between its tessellations.

    python tests/benchmarks/bench_tessellation.py [--set key=value …] [NAME …]

Every component of the sample and, where it is there, of ../shared/data: from STEP at three densities, from a mesh file as it is,
simplified and refined; once more with long thin triangles. Prints one line of JSON a component, then the least and the mean.
Labels are those of the faces as given; they are carried by nearest face from points drawn evenly over the surface.
"""

import argparse
import itertools
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import manifold3d
import numpy as np
import trimesh
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from rand_index import labels_of, rand_index

from gripwright.domain.shape import FloatArray, IntArray, Mesh
from gripwright.geometry.brep import tessellate
from gripwright.geometry.measures import diagonal_mm
from gripwright.geometry.mesh_repair import repaired
from gripwright.geometry.refine import refine, refined_face_count
from gripwright_builtin.segmenters.sdf import SdfSegmenter

ROOT = Path(__file__).resolve().parents[2]
SAMPLE, SHARED = ROOT / "service" / "gripwright" / "samples" / "pump", ROOT.parent / "shared" / "data"
POINTS = 20_000
FACES_MAX = 200_000
DENSITIES = {"coarse": (5e-3, 0.5), "middle": (1e-3, 0.15), "fine": (2e-4, 0.05)}
"""Largest chord error as a fraction of the diagonal, and angle between facets, rad."""
STRETCH = 25.0

Variants = dict[str, Mesh]


def step_variants(path: Path) -> Iterator[tuple[str, Variants]]:
    """Each solid of a STEP file that is not the like of an earlier one."""
    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    explorer = TopExp_Explorer(reader.OneShape(), TopAbs_ShapeEnum.TopAbs_SOLID)
    seen: list[Any] = []
    while explorer.More():
        solid = explorer.Current()
        explorer.Next()
        if any(solid.IsPartner(other) for other in seen):
            continue
        seen.append(solid)
        size = diagonal_mm(tessellate(solid, 1.0, 0.5))
        variants = {name: tessellate(solid, chord * size, angle) for name, (chord, angle) in DENSITIES.items()}
        variants["fine"] = fine(repaired(variants["fine"]), 0.02)
        variants["thin"] = thin(repaired(variants["middle"]))
        yield f"{path.stem}" if len(seen) == 1 else f"{path.stem} {len(seen)}", variants


def file_variants(path: Path) -> Variants:
    """A mesh file as it is, simplified, refined, and with long thin triangles."""
    file = trimesh.load(path, process=False)
    mesh = Mesh(vertices_mm=np.array(file.vertices, dtype=np.float64), faces=np.array(file.faces, dtype=np.int64))
    solid = repaired(mesh)
    variants = {"file": mesh, "fine": fine(solid, 0.015), "thin": thin(solid)}
    simple = simplified(solid)
    return variants if simple is None else {"coarse": simple, **variants}


def fine(mesh: Mesh, share: float) -> Mesh:
    """With no edge longer than that share of the diagonal, or than `FACES_MAX` allows."""
    longest = share * diagonal_mm(mesh)
    while refined_face_count(mesh, longest) > max(FACES_MAX, 1.5 * len(mesh.faces)):
        longest *= 1.25
    return refine(mesh, longest)


def simplified(mesh: Mesh) -> Mesh | None:
    """With fewer faces, none farther off than 1/4000 of the diagonal; None of a mesh that is no solid."""
    solid = manifold3d.Manifold(manifold3d.Mesh64(mesh.vertices_mm, mesh.faces.astype(np.uint64)))
    if solid.status() != manifold3d.Error.NoError:
        return None
    found = solid.simplify(diagonal_mm(mesh) / 4000.0).to_mesh64()
    return Mesh(vertices_mm=np.array(found.vert_properties)[:, :3], faces=np.array(found.tri_verts, dtype=np.int64))


def thin(mesh: Mesh) -> Mesh:
    """Divided finely along one direction only."""
    axis = int(np.argmin(np.ptp(mesh.vertices_mm, axis=0)))
    scale = np.ones(3)
    scale[axis] = STRETCH
    stretched = Mesh(vertices_mm=mesh.vertices_mm * scale, faces=mesh.faces)
    divided = fine(stretched, 0.06 * STRETCH * diagonal_mm(mesh) / diagonal_mm(stretched))
    return Mesh(vertices_mm=divided.vertices_mm / scale, faces=divided.faces)


def carried(points: FloatArray, mesh: Mesh, labels: IntArray) -> IntArray:
    """The label of the face nearest to each point."""
    shape = trimesh.Trimesh(mesh.vertices_mm, mesh.faces, process=False)
    return np.asarray(labels[trimesh.proximity.closest_point(shape, points)[2]])


def compare(variants: Variants, labels_of_mesh: Callable[[Mesh], IntArray]) -> dict[str, object]:
    """The number of segments of each variant, and the Rand index of each pair."""
    first = next(iter(variants.values()))
    shape = trimesh.Trimesh(first.vertices_mm, first.faces, process=False)
    points = np.asarray(trimesh.sample.sample_surface(shape, POINTS, seed=0)[0])
    found = {name: labels_of_mesh(mesh) for name, mesh in variants.items()}
    at = {name: carried(points, mesh, found[name]) for name, mesh in variants.items()}
    pairs = {f"{a}-{b}": round(rand_index(at[a], at[b]), 4) for a, b in itertools.combinations(variants, 2)}
    return {
        "faces": {name: len(mesh.faces) for name, mesh in variants.items()},
        "segments": {name: int(labels.max()) + 1 for name, labels in found.items()},
        "least": min(pairs.values()),
        "pairs": pairs,
    }


def components() -> Iterator[tuple[str, Variants]]:
    """Every solid that is looked at."""
    for path in sorted(SAMPLE.glob("*.step")):
        yield from ((f"sample/{name}", variants) for name, variants in step_variants(path))
    if SHARED.is_dir():
        yield from ((f"as1/{name}", variants) for name, variants in step_variants(SHARED / "as1" / "as1.stp"))
        for path in sorted(SHARED.glob("*/*.stl")):
            yield f"{path.parent.name}/{path.stem}", file_variants(path)


def main() -> None:
    """One line a component, then the summary."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="only components whose name contains one of these")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="parameter of the segmenter")
    arguments = parser.parse_args()
    settings = SdfSegmenter.Settings.model_validate(dict(item.split("=", 1) for item in arguments.set))
    least: dict[str, float] = {}
    for name, variants in components():
        if arguments.names and not any(part in name for part in arguments.names):
            continue
        line = compare(variants, lambda mesh: labels_of(mesh, settings))
        least[name] = float(str(line["least"]))
        print(json.dumps({"component": name, **line}), flush=True)
    values = np.array(list(least.values()))
    below = sorted(name for name, value in least.items() if value < 0.97)
    print(json.dumps({"components": len(least), "least": values.min(), "mean": round(values.mean(), 4), "below 0.97": below}))


if __name__ == "__main__":
    main()
