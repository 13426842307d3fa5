"""`segmenter=best`: of two analyses of a component the one that explains more of its surface."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest

from gripwright.design.analysis import analyse
from gripwright.design.plan import Plan, plan_of
from gripwright.design.runner import Ref
from gripwright.design.stage_table import STAGES
from gripwright.design.stages.keep import explained_share, keep
from gripwright.design.step_values import PreparedShape
from gripwright.domain.errors import Rejection
from gripwright.domain.shape import Analysis, Box, Cylinder, Mesh, Primitive, Segment, SegmentAnalysis
from gripwright.geometry.measures import face_areas_mm2
from gripwright.jobs.installed import installed_registry
from gripwright.jobs.steps import step_call
from gripwright.plugin_api import RunContext
from gripwright.registry.building import build_toolbox
from mesh_factory import STEPPED_SHAFT, box_mesh, filleted_boss, plate_with_bosses, turned_mesh

WIDE = Cylinder(
    center_C=np.array([0.0, 0.0, 10.0]), axis_C=np.array([0.0, 0.0, 1.0]), radius_mm=10.0, height_mm=20.0,
    internal=False, arc_rad=2 * np.pi, rms_mm=0.0, surface_filled=True,
)  # fmt: skip


class Here:
    """A runner that computes every call in this process, and keeps no more than it is asked for."""

    def __init__(self, plan: Plan) -> None:
        self.plan, self.toolbox = plan, build_toolbox(plan, installed_registry(None))
        self.values: list[Any] = []

    def put(self, value: Any) -> Ref:
        self.values.append(value)
        return str(len(self.values) - 1)

    def get(self, ref: Ref) -> Any:
        return self.values[int(ref)]

    def map(self, stage: str, calls: Sequence[Mapping[str, Any]]) -> list[Ref]:
        return [self.put(STAGES[stage].function(self._valued(call), self.plan, self.toolbox, RunContext())) for call in calls]

    def _valued(self, node: Any) -> Any:
        if isinstance(node, Mapping):
            return self.get(node["ref"]) if set(node) == {"ref"} else {name: self._valued(item) for name, item in node.items()}
        return [self._valued(item) for item in node] if isinstance(node, list) else node


def analysed(mesh: Mesh, **options: Any) -> Analysis:
    runner = Here(plan_of(options))
    ref = runner.put(mesh)
    found = analyse([ref, ref], runner.plan, runner)[ref]
    assert not isinstance(found.analysis, Rejection)
    assert isinstance(runner.get(found.prepared), PreparedShape)
    analysis: Analysis = runner.get(found.analysis)
    return analysis


def analysis_of(mesh: Mesh, primitive: Primitive | None, segmenter: str = "one", **timings: float) -> Analysis:
    """An analysis with one segment, all of the mesh."""
    area = float(face_areas_mm2(mesh).sum())
    whole = Segment(id=0, faces=np.arange(len(mesh.faces)), area_mm2=area, hull_volume_mm3=1.0)
    return Analysis(
        mesh=mesh,
        source_labels=np.zeros(len(mesh.faces), dtype=np.int64),
        segments=(SegmentAnalysis(segment=whole, primitive=primitive, fits=(), reason=""),),
        segmenter=segmenter,
        warnings=(),
        timings=timings,
    )


def test_a_cylinder_explains_its_own_surface_with_the_ends_and_nothing_else() -> None:
    shaft = turned_mesh(STEPPED_SHAFT, 256)
    thick = 2 * np.pi * 100.0 + 2 * np.pi * 10.0 * 20.0  # with the part of the end from which the thin step rises
    thin_end, thin_side, circle = np.pi * 25.0, 2 * np.pi * 5.0 * 25.0, np.pi * 25.0

    share = explained_share(analysis_of(shaft, WIDE))

    assert share == pytest.approx((thick - circle) / (thick - circle + thin_side + thin_end), rel=0.02)


@pytest.mark.parametrize("sections", [12, 24, 200])
def test_facets_of_a_coarse_cylinder_lie_on_it(sections: int) -> None:
    assert explained_share(analysis_of(turned_mesh((*STEPPED_SHAFT[:3], (0.0, 20.0)), sections), WIDE)) == pytest.approx(1.0)


def test_a_bore_is_not_explained_by_the_cylinder_that_fills_it() -> None:
    solid = turned_mesh((*STEPPED_SHAFT[:3], (0.0, 20.0)), 48)
    hollow = Mesh(vertices_mm=solid.vertices_mm, faces=solid.faces[:, ::-1])

    assert explained_share(analysis_of(hollow, WIDE)) == 0.0


def test_a_box_explains_the_surface_on_its_faces() -> None:
    box = Box(X_CB=np.eye(4), extents_mm=np.array([60.0, 40.0, 20.0]), filled=np.ones(6), filled_min=0.1, rms_mm=0.0)
    mesh = box_mesh((60.0, 40.0, 20.0))
    centred = Mesh(vertices_mm=mesh.vertices_mm - [30.0, 20.0, 10.0], faces=mesh.faces)
    askew = Mesh(vertices_mm=centred.vertices_mm + np.array([0.0, 0.0, 5.0]), faces=mesh.faces)

    assert explained_share(analysis_of(centred, box)) == pytest.approx(1.0)
    assert explained_share(analysis_of(askew, box)) == pytest.approx(1.0 - 2 * 2400.0 / 8800.0)


class Ball:
    """A primitive that cannot say which surface lies on it."""

    kind, volume_mm3, surface_filled = "ball", 1.0, True

    def __init__(self, rms_mm: float) -> None:
        self.rms_mm = rms_mm

    def to_dict(self) -> dict[str, Any]:
        return {}


@pytest.mark.parametrize(("rms_mm", "share"), [(0.01, 1.0), (1.0, 0.0)])
def test_a_primitive_that_cannot_say_what_lies_on_it_counts_by_its_deviation(rms_mm: float, share: float) -> None:
    assert explained_share(analysis_of(box_mesh((60.0, 40.0, 20.0)), Ball(rms_mm))) == pytest.approx(share)


def test_a_segment_without_a_primitive_explains_nothing() -> None:
    assert explained_share(analysis_of(box_mesh((6.0, 4.0, 2.0)), None)) == 0.0


def test_the_remark_names_both_shares_and_the_timings_are_those_of_both() -> None:
    mesh = box_mesh((60.0, 40.0, 20.0))
    none = analysis_of(mesh, None, "one", **{"prepare.refine": 1.0, "fit.box": 2.0})
    whole = analysis_of(mesh, Ball(0.0), "other", **{"prepare.refine": 1.0, "fit.box": 3.0, "segment.rays": 4.0})

    kept = keep([none, whole])

    assert kept.segmenter == "other"
    assert kept.remarks == ("other kept: its primitives explain 100.0 % of the surface, those of one 0.0 %",)
    assert kept.timings == {"prepare.refine": 1.0, "fit.box": 5.0, "segment.rays": 4.0}


def test_where_thickness_says_nothing_the_primitives_are_kept() -> None:
    kept = analysed(filleted_boss(24), segmenter="best")  # the fillet hides where the boss begins

    assert kept.segmenter == "primitives"
    assert len(kept.segments) == 2
    assert kept.remarks[-1].startswith("primitives kept: its primitives explain ")
    assert "those of sdf " in kept.remarks[-1]
    assert kept.sdf is not None
    assert {"segment.rays", "segment.surfaces"} <= kept.timings.keys()


@pytest.mark.parametrize("mesh", [turned_mesh(STEPPED_SHAFT, 48), plate_with_bosses(48)], ids=["shaft", "plate"])
def test_where_both_explain_alike_the_published_method_is_kept(mesh: Mesh) -> None:
    kept = analysed(mesh, segmenter="best")

    assert kept.segmenter == "sdf"
    assert kept.remarks[-1].endswith("(a tie: the first is kept)")


def test_one_segmenter_alone_is_kept_without_a_remark_of_the_choice() -> None:
    kept = analysed(box_mesh((30.0, 20.0, 10.0)), segmenter="sdf")

    assert (kept.segmenter, kept.remarks) == ("sdf", ())


def test_the_paper_knows_no_other_segmenter() -> None:
    assert build_toolbox(plan_of({"plan": "paper"}), installed_registry(None)).segmenters.keys() == {"sdf"}


def test_a_segmentation_is_stored_under_its_own_segmenter_alone() -> None:
    def key(options: Mapping[str, Any], segmenter: str) -> Ref:
        plan = plan_of(options)
        versions = build_toolbox(plan, installed_registry(None)).versions
        return step_call(STAGES["segment"], {"prepared": {"ref": "p"}, "segmenter": segmenter}, plan, versions)["key"]

    alone = key({"segmenter": "sdf"}, "sdf")

    assert key({"segmenter": "best"}, "sdf") == alone
    assert key({"segmenter": "best", "primitives.angle": 10.0}, "sdf") == alone
    assert key({"segmenter": "best", "sdf.rays": 10}, "sdf") != alone
    assert key({"segmenter": "best"}, "primitives") != alone
