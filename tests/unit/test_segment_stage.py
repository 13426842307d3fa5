"""Stage 2: segmenters are held to their contract; labels go back to the file's faces."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
import pytest

from gripwright.design import pipeline
from gripwright.design.plan import Plan
from gripwright.design.stages.segment import segment, source_labels
from gripwright.domain.assembly import AssemblyTask, Component
from gripwright.domain.errors import Fault, InvalidInput, PluginFailure, Rejection
from gripwright.domain.shape import Mesh, Segment
from gripwright.plugin_api import Params, RunContext
from mesh_factory import box_mesh, component_of


def _segment(number: int, faces: Sequence[int]) -> Segment:
    return Segment(id=number, faces=np.array(faces, dtype=np.int64), area_mm2=1.0, hull_volume_mm3=1.0)


class Given:
    """A segmenter that returns the segments that it was made with."""

    key: ClassVar[str] = "given"
    params_model: ClassVar[type[Params]] = Params

    def __init__(self, *segments: Segment) -> None:
        self._segments = segments

    def segment(self, component: Component, ctx: RunContext) -> Sequence[Segment]:
        return self._segments


BOX = component_of(box_mesh((1, 1, 1)))


def test_a_partition_passes() -> None:
    parts = (_segment(0, range(5)), _segment(1, range(5, 12)))

    assert segment(BOX, Given(*parts), RunContext()) == parts


def test_what_the_segmenter_cannot_divide_is_its_rejection() -> None:
    class Rejects(Given):
        def segment(self, component: Component, ctx: RunContext) -> Rejection:  # type: ignore[override]
            return Rejection("no-cad-faces", "its file has triangles alone")

    assert segment(BOX, Rejects(), RunContext()) == Rejection("no-cad-faces", "its file has triangles alone")


class FirstStages:
    """A runner that prepares nothing, rejects the meshes without CAD faces, and fits nothing to the others."""

    def __init__(self) -> None:
        self._values: list[Any] = []

    def put(self, value: Any) -> str:
        self._values.append(value)
        return str(len(self._values) - 1)

    def get(self, ref: str) -> Any:
        return self._values[int(ref)]

    def map(self, stage: str, calls: Sequence[Mapping[str, Any]]) -> list[str]:
        if stage == "prepare":
            return [call["mesh"]["ref"] for call in calls]
        meshes = [self.get(call["prepared"]["ref"]) for call in calls]
        return [self.put(Rejection("no-cad-faces", "has none") if mesh.cad_faces is None else ()) for mesh in meshes]


def test_a_design_is_refused_with_every_component_that_the_segmenter_cannot_divide() -> None:
    of_step = replace(BOX, id="base", mesh=replace(BOX.mesh, cad_faces=np.arange(12) // 2))
    components = (of_step, replace(BOX, id="lid"), replace(BOX, id="pin"))
    task = AssemblyTask(part_number="P", revision="", name="", components=components, obstacles=(), operations=())

    with pytest.raises(InvalidInput) as refused:
        pipeline.design(task, (), Plan(), FirstStages())

    assert refused.value.faults == (
        Fault("/components/1", "component 'lid': has none"),
        Fault("/components/2", "component 'pin': has none"),
    )


@pytest.mark.parametrize(
    ("parts", "fault"),
    [
        ((), "12 of 12 faces are in no segment"),
        ((_segment(0, range(11)),), "1 of 12 faces are in no segment"),
        ((_segment(0, range(12)), _segment(1, [3])), "1 in several"),
        ((_segment(1, range(12)),), "ids do not count from 0"),
        ((_segment(0, range(13)),), "outside 0 to 11"),
        ((_segment(0, range(12)), _segment(1, [])), "no faces"),
        ((_segment(0, [1, 0, *range(2, 12)]),), "ascending"),
    ],
)
def test_what_is_no_partition_is_the_plugins_failure(parts: tuple[Segment, ...], fault: str) -> None:
    with pytest.raises(PluginFailure, match=fault) as failure:
        segment(BOX, Given(*parts), RunContext())

    assert failure.value.context["plugin"] == "given"


def test_a_face_of_the_file_gets_the_label_of_most_of_its_area() -> None:
    triangles = np.array([[0, 0, 0, 4, 0, 0, 0, 1, 0], [0, 0, 0, 1, 0, 0, 0, 1, 0], [0, 0, 0, 1, 0, 0, 0, 1, 0]], dtype=float)
    mesh = Mesh(vertices_mm=triangles.reshape(-1, 3), faces=np.arange(9).reshape(3, 3), source_faces=np.array([1, 1, 4]))

    labels = source_labels(mesh, [_segment(0, [1, 2]), _segment(1, [0])], file_face_count=6)

    np.testing.assert_array_equal(labels, [1, 1, 1, 0, 0, 0])  # faces left out take the nearest one's
