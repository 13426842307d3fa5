"""Fingers in a bore: their nose is read off the hand, touches along lines, and enters nothing."""

import numpy as np
import pytest

from gripwright.design.contact import contacts, seat
from gripwright.design.gripping_surface import gripping_surface
from gripwright.design.holding import contact_radius_mm
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import EXTERNAL, INTERNAL, Grasp, GripRequirement
from gripwright.domain.pad import PAD
from gripwright.domain.shape import Cylinder, Mesh, Segment
from gripwright.geometry.frames import transform
from gripwright.geometry.held_surface import Surface
from gripwright.plugin_api import Params, RunContext
from gripwright_builtin.fitters.cylinder import CylinderFitter, CylinderParams
from gripwright_builtin.hands.centric import CentricHand, CentricSettings
from gripwright_builtin.planners.axial import AxialPlanner, AxialSettings
from gripwright_builtin.rules.cylinder import ThreeFingerBore
from mesh_factory import component_of, turned_mesh

HAND = CentricHand(CentricSettings())


def ring(outer: float, bore: float, height: float, sections: int) -> Mesh:
    """A ring about z, its bore a polygon inscribed in the circle."""
    walls = turned_mesh(((bore, height), (bore, 0.0), (outer, 0.0), (outer, height)), sections)
    k = np.arange(sections)
    a, b, c, d = 3 * sections + k, 3 * sections + (k + 1) % sections, (k + 1) % sections, k
    top = np.concatenate([np.stack((a, b, c), axis=1), np.stack((a, c, d), axis=1)])
    return Mesh(vertices_mm=walls.vertices_mm, faces=np.concatenate([walls.faces, top]))


def bore_of(mesh: Mesh) -> tuple[Segment, GripRequirement]:
    """The whole mesh as one segment, and what the rule asks for its bore."""
    segment = Segment(id=0, faces=np.arange(len(mesh.faces)), area_mm2=1.0, hull_volume_mm3=1.0)
    fit = CylinderFitter(CylinderParams()).fit(component_of(mesh), segment, RunContext())
    assert isinstance(fit, Cylinder)
    answer = ThreeFingerBore(Params()).apply(fit)
    assert not isinstance(answer, Rejection)
    return segment, answer[0]


def cylinder(radius: float, internal: bool) -> Cylinder:
    return Cylinder(
        center_C=np.zeros(3), axis_C=np.array([0.0, 0.0, 1.0]), radius_mm=radius, height_mm=10.0, internal=internal,
        arc_rad=2 * np.pi, rms_mm=0.0, surface_filled=True,
    )  # fmt: skip


def test_the_bore_of_a_ring_is_asked_for_beside_its_outer_surface() -> None:
    _, need = bore_of(ring(18.0, 12.0, 10.0, 96))

    assert (need.grip, need.opening_width_mm) == (INTERNAL, pytest.approx(24.0))
    assert isinstance(ThreeFingerBore(Params()).apply(cylinder(12.0, internal=False)), Rejection)


def test_an_external_finger_is_one_flat_and_a_nose_is_many() -> None:
    flat, nose = gripping_surface(HAND, EXTERNAL), gripping_surface(HAND, INTERNAL)

    assert [(one.width_mm, one.rounding_rad) for one in flat.flats] == [(10.0, 0.0)]
    assert (flat.y_range, flat.radius_mm, flat.thickness_mm) == ((-5.0, 5.0), np.inf, 8.0)
    assert nose.radius_mm == pytest.approx(4.0, rel=1e-3)
    assert nose.y_range == pytest.approx((-4.0 * np.sin(np.pi / 3), 4.0 * np.sin(np.pi / 3)))
    assert all(one.rounding_rad == pytest.approx(np.radians(2.0)) for one in nose.flats)


@pytest.mark.parametrize(("bore", "sections"), [(4.5, 64), (5.0, 24), (8.0, 18), (12.0, 33), (40.0, 200)])
def test_seated_in_a_bore_every_nose_touches_along_its_depth_and_enters_nothing(bore: float, sections: int) -> None:
    mesh = ring(bore + 6.0, bore, 10.0, sections)
    segment, need = bore_of(mesh)
    grasps = AxialPlanner(AxialSettings()).plan(component_of(mesh), segment, need, HAND, RunContext())
    seated = [grasp for grasp in (seat(grasp, Surface(mesh), HAND) for grasp in grasps) if isinstance(grasp, Grasp)]

    assert len(seated) == len(grasps)
    for grasp in seated[:: max(1, len(seated) // 6)]:
        touching = contacts(grasp, Surface(mesh), HAND, 30.0, 3.0)
        assert isinstance(touching, tuple), touching
        assert all(contact.height_mm >= 3.0 and 0.0 < contact.gap_mm < 0.05 for contact in touching)
        middle = np.mean([contact.centre_C for contact in touching], axis=0)
        assert all(contact.normal_C @ (middle - contact.centre_C) > 0.0 for contact in touching)
        (prism,) = HAND.finger(30.0, INTERNAL)
        for X_GF in HAND.finger_poses(grasp.opening_width_mm):
            corners = transform(grasp.X_CG @ X_GF, prism.vertices_mm)
            angles = np.arctan2(corners[:, 1], corners[:, 0])
            pitch = 2.0 * np.pi / sections
            wall = bore * np.cos(pitch / 2.0) / np.cos(np.mod(angles, pitch) - pitch / 2.0)  # of the polygon there
            assert (np.hypot(corners[:, 0], corners[:, 1]) < wall).all()


def test_one_depth_keeps_off_the_bottom_of_a_blind_bore() -> None:
    mesh = ring(18.0, 12.0, 3.6, 96)
    segment, need = bore_of(mesh)
    grasps = AxialPlanner(AxialSettings()).plan(component_of(mesh), segment, need, HAND, RunContext())

    depths = {round(float(abs(grasp.X_CG[2, 3] - (0.0 if grasp.X_CG[2, 2] > 0 else 3.6))), 3) for grasp in grasps}
    assert min(depths) == 3.2  # 3.6 less the margin and what the bottom keeps
    assert max(depths) == 3.6


def test_a_flat_pad_touches_with_the_components_curvature_and_a_bare_nose_along_a_line() -> None:
    flat, nose = gripping_surface(HAND, EXTERNAL), gripping_surface(HAND, INTERNAL)

    assert contact_radius_mm(cylinder(12.0, internal=False), flat) == 12.0
    line = contact_radius_mm(cylinder(12.0, internal=True), nose)
    assert 2.0 * np.sqrt(2.0 * line * PAD.compression * PAD.thickness_mm) < 0.2  # the widest strip that any force presses
