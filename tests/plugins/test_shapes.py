"""Each shape is recovered as it was built, in any pose, at any size, however tessellated; the others are refused."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fitting_cases import segment_of, whole_segment
from gripwright.design.stages.fit import fit
from gripwright.domain.assembly import Component
from gripwright.domain.errors import Rejection
from gripwright.domain.shape import Mesh, SegmentAnalysis
from gripwright.geometry.adjacency import face_adjacency
from gripwright.geometry.drawn import primitive_mesh
from gripwright.geometry.measures import face_areas_mm2, face_centres_mm, face_normals, volume_mm3
from gripwright.plugin_api import RunContext
from gripwright_builtin.fitters.box import BoxFitter, BoxParams
from gripwright_builtin.fitters.cylinder import CylinderFitter, CylinderParams
from gripwright_builtin.shapes.cone import Cone, ConeFitter, ConeParams
from gripwright_builtin.shapes.extrusion import Extrusion, ExtrusionFitter, ExtrusionParams
from gripwright_builtin.shapes.prism import Prism, PrismFitter, PrismParams
from gripwright_builtin.shapes.pyramid import Pyramid, PyramidFitter, PyramidParams
from gripwright_builtin.shapes.sphere import Sphere, SphereFitter, SphereParams
from gripwright_builtin.shapes.torus import Torus, TorusFitter, TorusParams
from shape_solids import (
    Manifold,
    cone,
    conical_bore,
    d_shaft,
    placed,
    profile,
    pyramid,
    rough,
    slot,
    surface,
    torus,
    turned_pose,
    zone,
)

FITTERS = {
    "cylinder": CylinderFitter(CylinderParams()),
    "box": BoxFitter(BoxParams()),
    "cone": ConeFitter(ConeParams()),
    "pyramid": PyramidFitter(PyramidParams()),
    "sphere": SphereFitter(SphereParams()),
    "torus": TorusFitter(TorusParams()),
    "prism": PrismFitter(PrismParams()),
    "extrusion": ExtrusionFitter(ExtrusionParams()),
}
L_PROFILE = [(0.0, 0.0), (30.0, 0.0), (30.0, 5.0), (5.0, 5.0), (5.0, 20.0), (0.0, 20.0)]
TRAPEZOID = [(0.0, 0.0), (30.0, 0.0), (24.0, 12.0), (6.0, 12.0)]

poses = st.integers(0, 2**16).map(turned_pose)
factors = st.sampled_from([0.05, 1.0, 20.0])
divisions = st.sampled_from([None, 0.1])
few = settings(max_examples=6, deadline=None, derandomize=True)


def found(key: str, mesh: Mesh) -> object:
    return FITTERS[key].fit(*whole_segment(mesh), RunContext())


def kept(mesh: Mesh) -> SegmentAnalysis:
    return fit(*whole_segment(mesh), FITTERS, RunContext())


def along(axis: np.ndarray, X: np.ndarray) -> float:
    return abs(float(axis @ X[:3, 2]))


@few
@given(
    angle=st.floats(1.0, 55.0),
    share=st.sampled_from([0.0, 0.3, 0.8]),
    sections=st.sampled_from([12, 48, 120]),
    X=poses,
    factor=factors,
    edge=divisions,
)
def test_a_cone_is_recovered(angle, share, sections, X, factor, edge):
    height = 10.0 * (1.0 - share) / np.tan(np.radians(angle))
    mesh = surface(cone(10.0, 10.0 * share, height, sections), X, factor=factor, edge=edge)

    one = found("cone", mesh)

    assert isinstance(one, Cone), one
    assert np.degrees(one.half_angle_rad) == pytest.approx(angle, rel=1e-3)
    assert one.radius_mm == pytest.approx(10.0 * factor, rel=1e-3)
    assert one.radius_top_mm == pytest.approx(10.0 * share * factor, abs=0.02 * factor)
    assert one.height_mm == pytest.approx(height * factor, rel=1e-3)
    assert one.axis_C @ X[:3, 2] == pytest.approx(1.0, abs=1e-6)
    assert one.truncated is (share > 0.0)
    assert one.surface_filled
    assert not one.internal
    assert one.arc_rad == pytest.approx(2.0 * np.pi)


def test_a_conical_bore_is_internal_and_narrows_where_it_does():
    mesh = surface(conical_bore(10.0, 6.0, 15.0, 48), turned_pose(1))
    centres, normals = face_centres_mm(mesh), face_normals(mesh)
    axis = turned_pose(1)[:3, 2]
    radial = centres - turned_pose(1)[:3, 3]
    radial -= np.outer(radial @ axis, axis)
    bore = np.flatnonzero((np.linalg.norm(radial, axis=1) < 10.1) & (np.abs(normals @ axis) < 0.9))

    one = FITTERS["cone"].fit(Component(id="c", mesh=mesh, X_PC=np.eye(4)), segment_of(mesh, bore), RunContext())

    assert isinstance(one, Cone), one
    assert one.internal
    assert (one.radius_mm, one.radius_top_mm) == pytest.approx((10.0, 6.0), rel=1e-3)
    assert one.axis_C @ axis == pytest.approx(1.0, abs=1e-6)


@few
@given(
    sides=st.integers(3, 8),
    top=st.sampled_from([0.0, 0.5, 0.9]),
    height=st.sampled_from([8.0, 25.0]),
    X=poses,
    factor=factors,
    edge=divisions,
)
def test_a_pyramid_is_recovered(sides, top, height, X, factor, edge):
    mesh = surface(pyramid(sides, 20.0, 20.0 * top, height), X, factor=factor, edge=edge)

    one = found("pyramid", mesh)

    assert isinstance(one, Pyramid), one
    assert one.volume_mm3 == pytest.approx(volume_mm3(mesh), rel=1e-3)
    if sides > 3 or top > 0.0:  # of a tetrahedron any face is a foot
        assert one.sides == sides
        assert one.height_mm == pytest.approx(height * factor, rel=1e-3)
        assert one.across_flats_mm == pytest.approx(20.0 * factor, rel=1e-3)
        assert one.axis_C @ X[:3, 2] == pytest.approx(1.0, abs=1e-6)
    assert one.surface_filled


@few
@given(
    cut=st.sampled_from([(-1.0, 1.0), (-0.8, 1.0), (-0.6, 0.6), (0.0, 1.0), (0.5, 1.0), (-0.2, 0.7)]),
    sections=st.sampled_from([16, 48, 96]),
    X=poses,
    factor=factors,
    edge=divisions,
)
def test_a_sphere_and_its_zone_are_recovered(cut, sections, X, factor, edge):
    low, high = cut
    mesh = surface(zone(12.0, 12.0 * low, 12.0 * high, sections), X, factor=factor, edge=edge)

    one = found("sphere", mesh)

    assert isinstance(one, Sphere), one
    assert one.radius_mm == pytest.approx(12.0 * factor, rel=1e-3)
    assert one.center_C == pytest.approx(X[:3, 3], abs=0.02 * factor)
    assert one.high_mm - one.low_mm == pytest.approx(12.0 * factor * (high - low), rel=0.01)
    if cut != (-1.0, 1.0):
        assert along(one.axis_C, X) == pytest.approx(1.0, abs=2e-3)
    assert one.surface_filled
    assert not one.internal


@few
@given(
    arc=st.sampled_from([60.0, 90.0, 180.0, 270.0, 360.0]),
    minor=st.sampled_from([3.0, 8.0]),
    sections=st.sampled_from([48, 96]),
    X=poses,
    factor=factors,
)
def test_a_torus_and_its_segment_are_recovered(arc, minor, sections, X, factor):
    mesh = surface(torus(20.0, minor, arc, sections), X, factor=factor)

    one = found("torus", mesh)

    assert isinstance(one, Torus), one
    assert one.major_radius_mm == pytest.approx(20.0 * factor, rel=1e-3)
    assert one.minor_radius_mm == pytest.approx(minor * factor, rel=1e-3)
    assert np.degrees(one.arc_rad) == pytest.approx(arc, abs=0.5)
    assert along(one.axis_C, X) == pytest.approx(1.0, abs=1e-6)
    if arc < 360.0:
        first = one.start_C if one.axis_C @ X[:3, 2] > 0.0 else None
        assert first is None or first @ X[:3, 0] == pytest.approx(1.0, abs=1e-3)
    assert one.surface_filled


@few
@given(sides=st.sampled_from([3, 5, 6, 7, 8]), height=st.sampled_from([3.0, 40.0]), X=poses, factor=factors, edge=divisions)
def test_a_regular_prism_is_recovered(sides, height, X, factor, edge):
    mesh = surface(pyramid(sides, 20.0, 20.0, height), X, factor=factor, edge=edge)

    one = found("prism", mesh)

    assert isinstance(one, Prism), one
    assert one.sides == sides
    assert one.across_flats_mm == pytest.approx(20.0 * factor, rel=1e-6)
    assert one.height_mm == pytest.approx(height * factor, rel=1e-6)
    assert along(one.axis_C, X) == pytest.approx(1.0, abs=1e-9)
    assert max(one.sides_C @ X[:3, 0]) == pytest.approx(1.0, abs=1e-6)
    assert one.filled == pytest.approx(np.ones(sides))
    assert one.ends_filled == pytest.approx(np.ones(2))


@few
@given(
    outline=st.sampled_from([L_PROFILE, TRAPEZOID, d_shaft(10.0, 7.0), slot(40.0, 14.0)]),
    height=st.sampled_from([5.0, 60.0]),
    X=poses,
    factor=factors,
    edge=divisions,
)
def test_an_extruded_profile_is_recovered(outline, height, X, factor, edge):
    mesh = surface(profile(outline, height), X, factor=factor, edge=edge)

    one = found("extrusion", mesh)

    assert isinstance(one, Extrusion), one
    assert one.volume_mm3 == pytest.approx(volume_mm3(mesh), rel=2e-3)
    assert one.height_mm == pytest.approx(height * factor, rel=1e-6)
    assert along(one.axis_C, X) == pytest.approx(1.0, abs=1e-6)
    assert one.ends_filled == pytest.approx(np.ones(2), rel=2e-3)
    assert one.surface_filled
    assert not one.internal


SOLIDS = {
    "cone": surface(cone(10.0, 4.0, 15.0, 48)),
    "pyramid": surface(pyramid(5, 20.0, 8.0, 18.0)),
    "sphere": surface(zone(12.0, -9.0, 12.0, 48)),
    "torus": surface(torus(20.0, 6.0, 360.0, 48)),
    "prism": surface(pyramid(6, 20.0, 20.0, 12.0)),
    "extrusion": surface(profile(TRAPEZOID, 25.0)),
    "cylinder": surface(Manifold.cylinder(20.0, 8.0, 8.0, 48)),
    "box": surface(Manifold.cube((30.0, 20.0, 10.0))),
}


@pytest.mark.parametrize("name", SOLIDS)
@pytest.mark.parametrize("share", [0.0, 5e-4])
def test_of_all_fitters_the_one_of_the_shape_is_kept_on_rough_surfaces_too(name, share):
    mesh = placed(SOLIDS[name], turned_pose(3), edge=0.12)

    analysis = kept(rough(mesh, share))

    assert analysis.primitive is not None, analysis.reason
    alike = {"prism", "extrusion"} if name == "prism" and share > 0.0 else {name}
    assert analysis.primitive.kind in alike, analysis.reason
    assert analysis.primitive.volume_mm3 == pytest.approx(volume_mm3(mesh), rel=0.03)


@pytest.mark.parametrize("name", SOLIDS)
def test_a_primitive_explains_the_surface_it_was_fitted_to_and_draws_itself_closed(name):
    mesh = placed(SOLIDS[name], turned_pose(5))
    one = kept(mesh).primitive

    follows = one.follows(face_centres_mm(mesh), face_normals(mesh), 0.05, np.radians(20.0))
    drawn = primitive_mesh(one)

    assert face_areas_mm2(mesh) @ follows >= 0.999 * face_areas_mm2(mesh).sum()
    assert not one.follows(face_centres_mm(mesh), -face_normals(mesh), 0.05, np.radians(20.0)).any()
    assert face_adjacency(drawn).open_edges == 0
    assert volume_mm3(drawn) == pytest.approx(one.volume_mm3, rel=0.02)


@pytest.mark.parametrize(
    ("key", "solid", "says"),
    [
        ("cone", surface(Manifold.cylinder(20.0, 8.0, 8.0, 48)), "half angle 0.00° is a cylinder, at least 0.50° needed"),
        ("cone", surface(Manifold.cube((30.0, 20.0, 10.0))), "no part of the surface follows a cone"),
        ("cone", surface(pyramid(8, 20.0, 8.0, 18.0)), "no part of the surface follows a cone"),
        ("cone", surface(zone(12.0, -12.0, 12.0, 64)), "lies on the best cone, at least 20.0 % needed"),
        ("pyramid", surface(Manifold.cube((20.0, 20.0, 20.0))), "at least 60.0 %"),
        ("pyramid", surface(pyramid(6, 20.0, 20.0, 12.0)), "no 3 to 8 flat sides stand evenly about an axis at 0.5 to 70.0°"),
        ("sphere", surface(Manifold.cylinder(20.0, 8.0, 8.0, 48)), "no part of the surface follows a sphere"),
        ("sphere", surface(Manifold.cube((20.0, 20.0, 20.0))), "no part of the surface follows a sphere"),
        ("sphere", surface(torus(20.0, 6.0, 360.0, 48)), "from a sphere, at most 0.1"),
        ("torus", surface(zone(12.0, -12.0, 12.0, 48)), "of its tube's radius, at least 0.050"),
        ("torus", surface(Manifold.cylinder(40.0, 8.0, 8.0, 48)), "torus"),
        ("prism", surface(Manifold.cube((20.0, 20.0, 20.0))), "four even sides are those of a box"),
        ("prism", surface(Manifold.cylinder(20.0, 8.0, 8.0, 48)), "from a regular prism, at most"),
        ("prism", surface(pyramid(5, 20.0, 8.0, 18.0)), "no 3 to 8 flat sides stand evenly about an axis"),
        (
            "extrusion",
            surface(Manifold.cube((30.0, 20.0, 10.0))),
            "the outline fills 100.0 % of a rectangle, a box; at most 99.5 %",
        ),
        ("extrusion", surface(Manifold.cylinder(20.0, 8.0, 8.0, 48)), "the outline is a circle, as a cylinder has"),
        ("extrusion", surface(cone(10.0, 4.0, 15.0, 48)), "of the surface is along an axis or at its ends, at least 90.0 %"),
    ],
)
def test_another_shape_is_refused_with_what_was_measured(key, solid, says):
    answer = found(key, placed(solid, turned_pose(2)))

    assert isinstance(answer, Rejection), answer
    assert answer.code == f"no-{key}"
    assert says in answer.detail


def test_of_fits_alike_the_fitter_named_first_is_kept_and_all_say_how_they_fared():
    mesh = placed(SOLIDS["prism"], turned_pose(4))
    orders = [("prism", "extrusion"), ("extrusion", "prism")]

    analyses = [fit(*whole_segment(mesh), {key: FITTERS[key] for key in order}, RunContext()) for order in orders]

    assert [analysis.primitive.kind for analysis in analyses] == ["prism", "extrusion"]
    assert all([record["volume_ratio"] for record in one.fits] == pytest.approx([1.0, 1.0]) for one in analyses)
