"""Assembly sequences proposed from the finished product."""

import json

import numpy as np
import pytest

from gripwright.cad.operations import operation_of, operations_document, validate_operations
from gripwright.design.scenes import Body
from gripwright.design.sequence_proposal import CLEAR_MM, propose_sequence
from gripwright.domain.assembly import Component, Operation
from gripwright.domain.errors import Rejection
from gripwright.domain.shape import FloatArray, Mesh
from mesh_factory import box_mesh, moved, turned_mesh


def at(x: float, y: float, z: float) -> FloatArray:
    X = np.eye(4)
    X[:3, 3] = x, y, z
    return X


def body(name: str, mesh: Mesh, X_PC: FloatArray | None = None) -> Body:
    return Body(component=Component(id=name, mesh=mesh, X_PC=np.eye(4) if X_PC is None else X_PC), solid=mesh)


def ring(inner: float, outer: float, low: float, high: float, sections: int = 48) -> Mesh:
    return turned_mesh(((inner, low), (outer, low), (outer, high), (inner, high), (inner, low)), sections)


def peg(radius: float, low: float, high: float, sections: int = 48) -> Mesh:
    return turned_mesh(((0.0, low), (radius, low), (radius, high), (0.0, high)), sections)


def operations(bodies: list[Body]) -> tuple[Operation, ...]:
    found = propose_sequence(bodies, 0.1)
    assert not isinstance(found, Rejection), found.detail
    return found


def bolted_flange() -> list[Body]:
    """A flange on a base, a headed bolt through both from above, a nut on it from below; all fit without play."""
    bolt = turned_mesh(((0.0, -14.0), (5.0, -14.0), (5.0, 10.0), (9.0, 10.0), (9.0, 16.0), (0.0, 16.0)), 40)
    return [
        body("nut", ring(5.0, 8.0, -14.0, -9.0, 44)),
        body("bolt", bolt),
        body("base", ring(5.0, 40.0, -9.0, 0.0, 36)),
        body("flange", ring(5.0, 25.0, 0.0, 10.0, 52)),
    ]


def test_a_bolted_joint_is_put_together_from_its_base_to_its_nut() -> None:
    steps = operations(bolted_flange())

    assert [step.active for step in steps] == [("base",), ("flange",), ("bolt",), ("nut",)]
    assert steps[0].passive == ()
    assert set(steps[3].passive) == {"base", "flange", "bolt"}
    assert [np.sign(step.motion[0][2, 3]) for step in steps] == [1, 1, 1, -1]
    assert all((step.motion[-1] == np.eye(4)).all() for step in steps)


def test_each_motion_begins_clear_of_what_stands() -> None:
    bodies = {item.component.id: item for item in bolted_flange()}

    for step in operations(list(bodies.values()))[1:]:
        way = step.motion[0][:3, 3]
        line = way / np.linalg.norm(way)
        moving = bodies[step.active[0]].solid.vertices_mm @ line + np.linalg.norm(way)
        standing = max(float((bodies[name].solid.vertices_mm @ line).max()) for name in step.passive)
        assert moving.min() - standing == pytest.approx(CLEAR_MM)


def test_the_pose_of_the_product_turns_the_motions_with_it() -> None:
    turned = np.array([[0.0, 0.0, 1.0, 5.0], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, -3.0], [0.0, 0.0, 0.0, 1.0]])
    bodies = [body(item.component.id, item.solid, turned) for item in bolted_flange()]

    ways = {step.active[0]: step.motion[0][:3, 3] for step in operations(bodies)}

    assert ways["bolt"] / np.linalg.norm(ways["bolt"]) == pytest.approx([1.0, 0.0, 0.0])
    assert ways["nut"] / np.linalg.norm(ways["nut"]) == pytest.approx([-1.0, 0.0, 0.0])


@pytest.mark.parametrize("overlap", [0.0, 0.05, 0.8])
def test_overlap_that_the_finished_product_has_does_not_stop_its_assembly(overlap: float) -> None:
    bodies = [body("block", ring(5.0, 30.0, 0.0, 20.0)), body("pin", peg(5.0 + overlap, 2.0, 25.0))]

    assert [step.active for step in operations(bodies)] == [("block",), ("pin",)]


def test_what_is_enclosed_has_no_sequence_and_the_reason_names_what_stops_it() -> None:
    outer, inner = box_mesh((40.0, 40.0, 40.0)), moved(box_mesh((20.0, 20.0, 20.0)), at(10, 10, 10))
    shell = Mesh(
        vertices_mm=np.concatenate([outer.vertices_mm, inner.vertices_mm]),
        faces=np.concatenate([outer.faces, inner.faces[:, ::-1] + len(outer.vertices_mm)]),
    )

    answer = propose_sequence([body("shell", shell), body("ball", moved(peg(4.0, 0.0, 8.0), at(20, 20, 15)))], 0.1)

    assert isinstance(answer, Rejection)
    assert answer.code == "no-sequence"
    assert answer.detail == "no straight motion takes out any of 'ball'; upwards 'ball' runs into 'shell'"


def test_a_proposed_sequence_is_a_document_that_can_be_given() -> None:
    steps = operations(bolted_flange())

    entries = validate_operations(json.loads(json.dumps(operations_document(steps))), {"base", "flange", "bolt", "nut"})

    for step, entry in zip(steps, entries, strict=True):
        read = operation_of(entry)
        assert (read.id, read.active, read.passive) == (step.id, step.active, step.passive)
        np.testing.assert_allclose(read.motion, step.motion, atol=1e-12)
