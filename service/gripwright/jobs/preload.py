"""Imported by the server that children are forked from, and by nothing else: everything heavy, once."""

import gc
import signal

import numpy as np

from gripwright.design.toolbox import record_classes
from gripwright.domain.shape import Mesh
from gripwright.geometry.clipping import clip_to_box, corners_within, near_box
from gripwright.geometry.collision import winding_numbers
from gripwright.geometry.facets import coplanar_patches
from gripwright.geometry.polytope import Polytope
from gripwright.geometry.raster import first_seen
from gripwright.geometry.refine import refine
from gripwright.geometry.rooms import rooms
from gripwright.geometry.triangle_blocks import TriangleBlocks
from gripwright.geometry.withdrawal import standing, withdrawn
from gripwright.jobs.installed import installed_registry
from gripwright.jobs.steps import STAGES_AT, load_stages
from gripwright.settings import load_settings


def _rehearse() -> None:
    """Call what is compiled once: numba takes a quarter of a second to get ready, which each child would spend again.

    Nothing that starts threads, which a fork would not take along.
    """
    tetrahedron = Mesh(
        vertices_mm=np.vstack([np.zeros(3), np.eye(3)]), faces=np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    )
    coplanar_patches(tetrahedron, np.arange(4))
    refine(tetrahedron, 1.0)
    first_seen(tetrahedron.triangles_mm, 2, 2)
    rooms(*np.zeros((4, 1, 3)))
    near_box(tetrahedron.vertices_mm, np.ones(4), np.eye(4), np.zeros(3), np.ones(3))
    whole = withdrawn(Polytope(tetrahedron.vertices_mm).faces, np.array([0.0, 0.0, -1.0]), 1.0)
    TriangleBlocks(tetrahedron).last_touch_mm(whole, standing(np.eye(4)), np.eye(4), 0.0, 1.0)
    clip_to_box(tetrahedron.triangles_mm, np.zeros(3), np.ones(3))
    corners_within(tetrahedron.triangles_mm, np.eye(3), np.ones(3))
    winding_numbers(tetrahedron, np.zeros((1, 3)))


# A service manager that stops everything at once must not make a running step look crashed: the worker decides.
signal.signal(signal.SIGTERM, signal.SIG_IGN)

installed_registry(load_settings().plugins_allow)
for stage in load_stages(STAGES_AT).values():
    stage.function  # noqa: B018 - imports the calculation
record_classes()
_rehearse()
gc.collect()
gc.freeze()  # what is here stays: else each child's collector looks through all of it, and copies the memory to do so
