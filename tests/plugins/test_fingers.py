from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.STEPControl import STEPControl_Reader
from scipy.spatial import ConvexHull

from gripwright.cad.export import step_bytes
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import CENTRIC_3, CENTRIC_4, EXTERNAL, INTERNAL, PARALLEL_2
from gripwright.domain.gripper import Actuator, BondedFinger, FingerDesign, FingerSpec, JawInterface
from gripwright.domain.pad import Pad
from gripwright.geometry import brep
from gripwright.geometry.measures import face_areas_mm2, face_normals, volume_mm3
from gripwright.plugin_api import RunContext
from gripwright_builtin.fingers.outline import clip, convex_hull, inset_mm, rectangle, sector, width_mm
from gripwright_builtin.fingers.stem import SliceStem
from gripwright_builtin.fingers.stiffness import bend, polygon_section, rectangle_section
from gripwright_builtin.fingers.straight import StraightFinger, StraightFingerParams
from gripwright_builtin.hands.centric import CentricHand, CentricSettings


def make_spec(fingers: int = 3, *, opening_mm: float = 60.5, length_mm: float = 30.0, **changes) -> FingerSpec:
    """A spec whose envelope just holds stem, bolts and jaw."""
    gripper_type = {2: PARALLEL_2, 3: CENTRIC_3, 4: CENTRIC_4}[fingers]
    offset = changes.pop("jaw_offset_mm", 9.25)
    jaw = changes.get("jaw", JawInterface())
    reference = opening_mm / 2.0 - offset
    spec = FingerSpec(
        gripper_type=gripper_type,
        grip=EXTERNAL,
        finger_length_mm=length_mm,
        jaw_offset_mm=offset,
        opening_min_mm=opening_mm - 8.0,
        opening_max_mm=opening_mm,
        stroke_mm=8.0,
        fingers=fingers,
        envelope_mm=float(max(np.hypot(opening_mm / 2 + 8, 5), np.hypot(reference + jaw.depth_mm, jaw.width_mm / 2))),
        actuator=Actuator(maker="Maker", model="M1", gripper_type=gripper_type, stroke_mm=8.0),
        contact_radii_mm=(),
        grip_force_N=60.0,
    )
    return replace(spec, **changes)


def design(spec: FingerSpec, **params) -> FingerDesign | Rejection:
    return StraightFinger(StraightFingerParams(**params)).design(spec, RunContext())


def designed(spec: FingerSpec, **params) -> FingerDesign:
    finger = design(spec, **params)
    assert isinstance(finger, FingerDesign), finger
    return finger


def specs() -> st.SearchStrategy[FingerSpec]:
    """Both types and grips, W 5..200, L 5..120, jaws from 5 mm to 60 mm inside or 20 mm outside of the gripping surface."""

    def build(fingers: int, opening: float, length: float, stroke: float, offset: float, grip: str) -> FingerSpec:
        floor = {2: 0.0, 3: 10.0 / np.sqrt(3.0), 4: 10.0}[fingers] + (16.0 if grip == INTERNAL else 0.0)
        opening = max(opening, floor)
        low = max(opening - stroke, floor)
        offset = min(offset, low / 2.0 - (9.2 if fingers == 4 else 5.0))  # room for the bolt heads between two bases
        spec = make_spec(fingers, opening_mm=opening, length_mm=length, jaw_offset_mm=offset)
        return replace(spec, grip=grip, opening_min_mm=low, stroke_mm=stroke, grip_force_N=5.0)

    return st.builds(
        build,
        st.sampled_from([2, 3, 4]),
        st.floats(5, 200),
        st.floats(5, 120),
        st.floats(2, 50),
        st.floats(-20, 60),
        st.sampled_from([EXTERNAL, INTERNAL]),
    )


@settings(max_examples=20, deadline=None)
@given(specs())
def test_every_possible_finger_is_one_valid_solid_whose_mesh_has_its_volume(spec: FingerSpec) -> None:
    finger = designed(spec)

    solid = brep.single_solid(brep.read_brep(finger.brep))
    assert brep.measure(solid).volume_mm3 == pytest.approx(finger.volume_mm3, rel=1e-9)
    assert volume_mm3(finger.mesh) == pytest.approx(finger.volume_mm3, rel=5e-3)


def is_round(spec: FingerSpec) -> bool:
    return spec.grip == INTERNAL and spec.gripper_type != PARALLEL_2


@settings(max_examples=20, deadline=None)
@given(specs())
def test_the_stem_is_the_hand_models_box_and_the_base_stays_in_its_room(spec: FingerSpec) -> None:
    finger = designed(spec)
    vertices, solid = finger.mesh.vertices_mm, brep.bounds_mm(brep.read_brep(finger.brep))

    stem = vertices[vertices[:, 2] > -spec.finger_length_mm + 1e-6]
    x_range = [0.0, 8.0] if spec.grip == EXTERNAL else [-8.0, 0.0]
    half = 5.0
    if is_round(spec):
        x_range, half = [-3.6, 0.0], 4.0 * np.sin(np.pi / spec.fingers)
    chord_mm = 4.0 * (1.0 - np.cos(np.radians(1.5))) if is_round(spec) else 1e-6  # the mesh of a nose need not have its crest
    assert [stem[:, 0].min(), stem[:, 0].max()] == pytest.approx(x_range, abs=chord_mm)
    assert stem[:, 0].max() <= x_range[1] + 1e-6
    assert [stem[:, 1].min(), stem[:, 1].max()] == pytest.approx([-half, half], abs=1e-6)
    assert solid[1, 2] == pytest.approx(0.0, abs=1e-6)
    assert np.hypot(vertices[:, 0] + spec.opening_max_mm / 2.0, vertices[:, 1]).max() <= spec.envelope_mm + 1e-6
    for side in sector(spec.fingers, spec.opening_min_mm, 0.0):
        assert side.depth_mm(vertices[:, :2]).min() >= -1e-6


@pytest.mark.parametrize(("fingers", "grip", "facing"), [(2, EXTERNAL, -1.0), (3, EXTERNAL, -1.0), (2, INTERNAL, 1.0)])
def test_the_gripping_surface_is_whole_at_x_zero_and_faces_the_component(fingers: int, grip: str, facing: float) -> None:
    mesh = designed(make_spec(fingers, grip=grip)).mesh

    on_plane = (np.abs(mesh.triangles_mm[:, :, 0]).max(axis=1) < 1e-9) & (mesh.triangles_mm[:, :, 2].min(axis=1) > -30.001)
    assert face_areas_mm2(mesh)[on_plane].sum() == pytest.approx(10.0 * 30.0, rel=1e-6)
    assert np.allclose(face_normals(mesh)[on_plane], [facing, 0.0, 0.0])


@pytest.mark.parametrize(("radius", "thickness"), [(2.0, 1.5), (4.0, 3.6), (9.0, 4.0), (15.0, 14.9)])
def test_a_finger_for_bores_lies_within_its_hand_and_its_nose_is_a_cylinder_that_touches_x_zero(
    radius: float, thickness: float
) -> None:
    spec = make_spec(grip=INTERNAL, jaw_offset_mm=-22.0, envelope_mm=90.0, grip_force_N=5.0)
    hand = CentricHand(CentricSettings(nose_radius_mm=radius, nose_thickness_mm=thickness))
    (prism,) = hand.finger(spec.finger_length_mm, INTERNAL)
    walls = ConvexHull(prism.vertices_mm[:, :2]).equations

    vertices = designed(spec, nose_radius=radius, nose_thickness=thickness).mesh.vertices_mm
    stem = vertices[vertices[:, 2] > -spec.finger_length_mm + 1e-6]

    assert (stem[:, :2] @ walls[:, :2].T + walls[:, 2]).max() <= 1e-9
    assert stem[:, 0].max() == pytest.approx(0.0, abs=radius * (1.0 - np.cos(np.radians(1.5))))
    nose = stem[(stem[:, 0] > -0.49 * radius) & (np.abs(stem[:, 2]) < 1e-9)]
    assert np.hypot(nose[:, 0] + radius, nose[:, 1]) == pytest.approx(np.full(len(nose), radius))
    assert np.diff(np.sort(np.arctan2(nose[:, 1], nose[:, 0] + radius))).max() < np.radians(3.01)


@pytest.mark.parametrize(("opening_mm", "room"), [(8.0, True), (7.99, False)])
def test_three_fingers_for_bores_close_to_the_cylinder_that_they_are_slices_of(opening_mm: float, room: bool) -> None:
    hand = CentricHand(CentricSettings())
    answer = design(make_spec(grip=INTERNAL, opening_mm=opening_mm + 8.0, jaw_offset_mm=-14.0, envelope_mm=60.0))

    assert hand.opening_floor_mm(INTERNAL) == 8.0
    assert isinstance(answer, FingerDesign) is room
    if isinstance(answer, Rejection):
        assert answer.code == "fingers-meet"


def read_step(step: bytes, folder: Path) -> brep.Shape:
    """As a CAM program would read it."""
    file = folder / "finger.step"
    file.write_bytes(step)
    reader = STEPControl_Reader()
    assert reader.ReadFile(str(file)) == IFSelect_ReturnStatus.IFSelect_RetDone
    reader.TransferRoots()
    return reader.OneShape()


@pytest.mark.parametrize("grip", [EXTERNAL, INTERNAL])
@pytest.mark.parametrize("offset_mm", [-20.0, 0.0, 9.25, 22.0])
def test_the_step_file_holds_one_valid_solid_with_holes_where_the_jaw_has_threads_and_pin(
    offset_mm: float, grip: str, tmp_path: Path
) -> None:
    finger = designed(make_spec(jaw_offset_mm=offset_mm, grip=grip))

    solid = brep.single_solid(read_step(step_bytes(finger.brep, name="Finger", part_number="F-1"), tmp_path))

    back = -30.0 - finger.properties["base_thickness_mm"]
    x, seat = 7.0 - offset_mm, -34.5
    assert brep.measure(solid).volume_mm3 == pytest.approx(volume_mm3(finger.mesh), rel=5e-3)
    assert np.array(brep.bores_z(solid)) == pytest.approx(
        np.array(
            [
                (x, -9.0, 4.5, back, seat),
                (x, -9.0, 7.5, seat, -30.0),
                (x, 0.0, 3.0, back, back + 5.5),
                (x, 9.0, 4.5, back, seat),
                (x, 9.0, 7.5, seat, -30.0),
            ]
        ),
        abs=1e-6,
    )


def test_the_centre_of_mass_lies_on_the_fingers_plane_of_symmetry() -> None:
    properties = designed(make_spec()).properties

    assert properties["com_y_mm"] == pytest.approx(0.0, abs=1e-6)
    assert -30.0 - properties["base_thickness_mm"] < properties["com_z_mm"] < 0.0


def test_a_jaw_far_inside_gives_a_base_as_thick_as_its_moment_needs() -> None:
    near = designed(make_spec(jaw_offset_mm=9.25), material="pa12")
    far = designed(make_spec(opening_mm=124.9, jaw_offset_mm=41.45), material="pa12")

    assert far.properties["base_thickness_mm"] > near.properties["base_thickness_mm"]
    assert max(far.properties["deflection_mm"], near.properties["deflection_mm"]) <= 0.5


def test_the_material_is_the_first_that_is_stiff_enough() -> None:
    assert designed(make_spec(length_mm=20.0)).material.startswith("PA12")
    assert designed(make_spec(length_mm=60.0)).material.startswith("aluminium")
    assert designed(make_spec(length_mm=120.0, grip_force_N=120.0)).material.startswith("steel")


def test_mass_is_volume_times_density_of_finger_and_pad() -> None:
    finger = designed(make_spec(), material="aluminium")

    pad_mm3 = 1.0 * 10.0 * 30.0
    assert finger.mass_kg == pytest.approx((finger.volume_mm3 - pad_mm3) * 2700e-9 + pad_mm3 * 1300e-9)


def bonded(finger: FingerDesign) -> BondedFinger:
    assert finger.bonded is not None
    return finger.bonded


@pytest.mark.parametrize(("fingers", "grip"), [(2, EXTERNAL), (3, EXTERNAL), (2, INTERNAL)])
def test_a_pad_as_thick_as_asked_covers_the_gripping_surface_and_its_seat_fits_it(fingers: int, grip: str) -> None:
    finger = designed(make_spec(fingers, grip=grip, pad=Pad(thickness_mm=1.5, rubber="silicone")))
    parts = bonded(finger)
    pad, bare, whole = (brep.read_brep(data) for data in (parts.pad.brep, parts.bare.brep, finger.brep))

    x = [0.0, 1.5] if grip == EXTERNAL else [-1.5, 0.0]
    assert brep.bounds_mm(pad) == pytest.approx(np.array([[x[0], -5.0, -30.0], [x[1], 5.0, 0.0]]), abs=1e-6)
    assert brep.measure(brep.common(pad, bare)).volume_mm3 == pytest.approx(0.0, abs=1e-6)
    volumes = [brep.measure(shape).volume_mm3 for shape in (pad, bare, brep.fuse(bare, pad), whole)]
    assert volumes[0] == pytest.approx(1.5 * 10.0 * 30.0)
    assert volumes[0] + volumes[1] == pytest.approx(volumes[2])
    assert volumes[2] == pytest.approx(volumes[3])
    assert parts.pad.material == "silicone rubber 70 Shore A"
    for part, shape in ((parts.pad, pad), (parts.bare, bare)):
        assert volume_mm3(part.mesh) == pytest.approx(brep.measure(brep.single_solid(shape)).volume_mm3, rel=5e-3)


def test_a_nose_for_bores_carries_no_pad() -> None:
    assert designed(make_spec(grip=INTERNAL, grip_force_N=5.0)).bonded is None


@pytest.mark.parametrize(("pad_mm", "fits"), [(6.8, True), (6.81, False)])
def test_the_pad_leaves_the_stem_its_least_wall(pad_mm: float, fits: bool) -> None:
    answer = design(make_spec(grip_force_N=1.0, pad=Pad(thickness_mm=pad_mm)))

    assert isinstance(answer, FingerDesign) is fits
    if isinstance(answer, Rejection):
        assert (answer.code, "1.19 mm" in answer.detail) == ("wall-too-thin", True)


def test_what_bends_is_the_stem_without_its_pad() -> None:
    thin, thick = (designed(make_spec(2, pad=Pad(thickness_mm=t)), material="steel") for t in (0.5, 4.0))

    stems = [30.0 * 30.0**3 / (3.0 * 210_000.0 * 10.0 * (8.0 - t) ** 3 / 12.0) for t in (0.5, 4.0)]
    assert thick.properties["deflection_mm"] - thin.properties["deflection_mm"] == pytest.approx(stems[1] - stems[0], rel=1e-6)


@pytest.mark.parametrize(
    ("spec", "code"),
    [
        (make_spec(2, grip_force_N=5000.0), "finger-too-weak"),
        (make_spec(envelope_mm=30.0), "base-outside-envelope"),
        (make_spec(opening_mm=9.0, opening_min_mm=2.0, jaw_offset_mm=-12.0), "fingers-meet"),
        (make_spec(opening_mm=20.0, jaw_offset_mm=5.0), "no-room-for-bolts"),
        (make_spec(jaw=JawInterface(bolt_pitch_mm=16.0, bolt_setback_mm=11.0)), "bolt-under-stem"),
        (make_spec(jaw=JawInterface(bolt_thread_mm=7.0)), "unknown-screw"),
    ],
)
def test_what_cannot_be_made_is_rejected_with_its_reason(spec: FingerSpec, code: str) -> None:
    answer = design(spec)

    assert isinstance(answer, Rejection)
    assert answer.code == code


def test_the_rejection_says_by_how_much_the_base_is_too_large() -> None:
    need = float(np.hypot(60.5 / 2 + 8, 5))

    answer = design(make_spec(envelope_mm=need - 2.5))

    assert isinstance(answer, Rejection)
    assert "2.50 mm more" in answer.detail


def test_a_finger_heavier_than_the_actuator_allows_is_rejected() -> None:
    spec = make_spec()

    answer = design(replace(spec, actuator=replace(spec.actuator, finger_mass_max_kg=0.001)))

    assert isinstance(answer, Rejection)
    assert answer.code == "finger-too-heavy"


def test_the_same_spec_gives_the_same_finger_byte_for_byte() -> None:
    first, second = designed(make_spec()), designed(make_spec())

    assert first.brep == second.brep
    assert np.array_equal(first.mesh.vertices_mm, second.mesh.vertices_mm)
    assert np.array_equal(first.mesh.faces, second.mesh.faces)


def test_a_stem_on_a_rigid_base_bends_as_a_cantilever() -> None:
    bending = bend(20.0, 1650.0, 30.0, rectangle_section(8.0, 10.0), np.array([0.0, 0.0]), np.array([20.0, 20.0]), 10.0)

    assert bending.deflection_mm == pytest.approx(20.0 * 30.0**3 / (3.0 * 1650.0 * 10.0 * 8.0**3 / 12.0))
    assert bending.stress_MPa == pytest.approx(20.0 * 30.0 * 6.0 / (10.0 * 8.0**2))


def test_a_polygon_bends_as_its_rectangle_and_a_slice_as_the_closed_form_says() -> None:
    square, flat = polygon_section(rectangle(-3.0, 5.0, 10.0)), rectangle_section(8.0, 10.0)
    slice_ = SliceStem(slices=3, nose_radius_mm=4.0, thickness_mm=3.9999).section

    alpha, centre = np.pi / 3.0, 2.0 * 4.0 * np.sin(np.pi / 3.0) / np.pi  # of a sector of 120°, from its corner
    inertia = 4.0**4 / 4.0 * (alpha + np.sin(alpha) * np.cos(alpha)) - alpha * 4.0**2 * centre**2
    assert (square.inertia_mm4, square.fibre_mm) == pytest.approx((flat.inertia_mm4, flat.fibre_mm))
    assert (slice_.inertia_mm4, slice_.fibre_mm) == pytest.approx((inertia, centre), rel=2e-3)


def test_an_arm_of_constant_width_adds_its_turn_times_the_lever() -> None:
    stem = bend(20.0, 1650.0, 30.0, rectangle_section(8.0, 10.0), np.array([0.0, 0.0]), np.array([20.0, 20.0]), 10.0)
    arm = bend(20.0, 1650.0, 30.0, rectangle_section(8.0, 10.0), np.linspace(0.0, 40.0, 9), np.full(9, 20.0), 10.0)

    turn = 20.0 * 35.0 * 40.0 / (1650.0 * 20.0 * 10.0**3 / 12.0)
    assert arm.deflection_mm - stem.deflection_mm == pytest.approx(turn * 35.0)


def test_clipping_keeps_exactly_the_points_inside() -> None:
    square = rectangle(-10.0, 10.0, 20.0)
    side = sector(3, 10.0, 0.5)[0]

    kept = clip(square, side)

    assert side.depth_mm(kept).min() == pytest.approx(0.0, abs=1e-9)
    assert inset_mm(square, kept) >= -1e-9
    assert len(clip(square, replace(side, distance_mm=100.0))) == 0


def test_an_outline_is_as_wide_as_its_corners_say() -> None:
    outline = convex_hull(np.concatenate([rectangle(-20.0, -10.0, 28.0), rectangle(0.0, 8.0, 16.0)]))

    assert width_mm(outline, np.array([-15.0, -10.0, 8.0])) == pytest.approx([28.0, 28.0, 16.0])
    assert np.all(np.diff(width_mm(outline, np.linspace(-10.0, 8.0, 20))) <= 0.0)
