"""What the report shows of fitted primitives: their solids, and their size in words."""

import io

import numpy as np
import pytest
from PIL import Image

from gripwright.cad.colour import segment_colours
from gripwright.domain.shape import Analysis, Segment, SegmentAnalysis
from gripwright.report.page import _size
from gripwright.report.views import drawn_primitives, primitives_view
from gripwright.testing.primitives import box, cylinder
from mesh_factory import box_mesh


class Shapeless:
    """A primitive that does not say what it looks like."""

    kind, volume_mm3, surface_filled, rms_mm = "cloud", 1.0, True, 0.0

    def to_dict(self):
        return {}


def analysis_of(*primitives):
    mesh = box_mesh((1.0, 1.0, 1.0))
    segments = tuple(
        SegmentAnalysis(
            segment=Segment(id=k, faces=np.arange(12), area_mm2=6.0, hull_volume_mm3=1.0), primitive=one, fits=(), reason=""
        )
        for k, one in enumerate(primitives)
    )
    return Analysis(
        mesh=mesh, source_labels=np.zeros(12, dtype=np.int64), segments=segments, segmenter="none", warnings=(), timings={}
    )


def test_each_kept_primitive_that_can_be_is_drawn_for_its_segment():
    solids = drawn_primitives(analysis_of(cylinder(np.eye(4)), None, Shapeless(), box(np.eye(4))))

    assert list(solids) == [0, 3]
    assert np.ptp(solids[3].vertices_mm, axis=0) == pytest.approx([40.0, 30.0, 12.0])


def test_a_picture_shows_every_primitive_in_the_colour_of_its_segment():
    far = np.eye(4)
    far[:3, 3] = [60.0, 0.0, 0.0]
    png = primitives_view(drawn_primitives(analysis_of(cylinder(np.eye(4)), box(far))))

    pixels = np.asarray(Image.open(io.BytesIO(png)).convert("RGB"), dtype=float).reshape(-1, 3)
    hues = pixels[pixels.min(axis=1) < 250.0]
    hues = hues / np.linalg.norm(hues, axis=1, keepdims=True)
    for colour in segment_colours(np.array([0, 1])):
        assert (hues @ (colour / np.linalg.norm(colour)) > 0.999).mean() > 0.1


@pytest.mark.parametrize(
    ("primitive", "says"),
    [
        ({"kind": "cylinder", "radius": 6.0, "height": 20.0}, "⌀12.00 × 20.00"),
        ({"kind": "box", "extents": [1.0, 2.0, 3.0]}, "1.00 × 2.00 × 3.00"),
        (
            {"kind": "prism", "sides": 6, "across_flats": 17.0, "axis": [0.0, 0.0, 1.0], "internal": False, "rms": 0.1},
            "sides 6, across flats 17",
        ),
    ],
)
def test_the_size_of_a_primitive_is_told_by_its_plain_numbers(primitive, says):
    assert _size(primitive) == says
