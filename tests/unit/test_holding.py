"""The holding model against closed forms, an independent convex program, and the invariances that physics demands."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq, linprog
from scipy.spatial.transform import Rotation

from gripwright.design.holding import hold
from gripwright.design.holding_load import operation_load
from gripwright.domain.grasp import CENTRIC_3, EXTERNAL, PARALLEL_2, Grasp
from gripwright.domain.holding import Contact, Load
from gripwright.domain.pad import PAD, Pad
from gripwright.domain.shape import FloatArray
from gripwright.geometry.wrenches import ACCELERATION_M_S2, GRAVITY_M_S2, wrenches

_MU = 0.2
_DOWN = np.array([0.0, 0.0, -1.0])


def two_pads(width_mm: float = 40.0, height_mm: float = 10.0, across_mm: float = 8.0) -> tuple[Grasp, list[Contact]]:
    """A block of `width_mm` held by two flat pads; component frame = gripper frame."""
    return _grasp(2, width_mm, PARALLEL_2), _contacts(2, width_mm / 2.0, height_mm, across_mm * height_mm)


def three_pads(radius_mm: float = 20.0, height_mm: float = 10.0) -> tuple[Grasp, list[Contact]]:
    """A cylinder held by three pads."""
    return _grasp(3, 2.0 * radius_mm, CENTRIC_3), _contacts(3, radius_mm, height_mm, height_mm)


def load(mass_kg: float = 1.0, force_N: float = 0.0, centroid: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Load:
    """A component that is lowered along −z."""
    motion = np.tile(np.eye(4), (2, 1, 1))
    motion[0, 2, 3] = 50.0
    return operation_load(motion, np.eye(4), np.array(centroid), mass_kg, force_N)


def mean_distance(width: float, height: float) -> float:
    """Mean distance of a rectangle's points from its centre, by brute force."""
    x, y = np.meshgrid((np.arange(400) + 0.5) / 400 - 0.5, (np.arange(400) + 0.5) / 400 - 0.5)
    return float(np.hypot(x * width, y * height).mean())


def test_two_pads_hold_a_block_along_them_with_its_load_over_friction() -> None:
    """Each pad presses with F/2 and rubs with up to μ·F/2: both together hold μ·F."""
    grasp, touching = two_pads()
    still = load(mass_kg=0.0, force_N=30.0)

    held = hold(grasp, touching, np.inf, still, _MU)

    assert held.required_force_N == pytest.approx(30.0 / _MU)
    assert held.contact_area_mm2 == pytest.approx(160.0)


def test_a_carried_block_needs_weight_and_acceleration_over_friction() -> None:
    """Worst is the robot that accelerates upwards: m·(g + a) along the pads."""
    grasp, touching = two_pads()

    held = hold(grasp, touching, np.inf, load(mass_kg=1.5), _MU)

    assert held.required_force_N == pytest.approx(1.5 * (GRAVITY_M_S2 + ACCELERATION_M_S2) / _MU)


@pytest.mark.parametrize("radius_mm", [5.0, 20.0, 80.0])
def test_three_pads_hold_a_cylinder_along_its_axis_with_its_load_over_friction_whatever_its_radius(radius_mm: float) -> None:
    """Each of three presses with F/3 and rubs with μ·F/3: μ·F again."""
    grasp, touching = three_pads(radius_mm)

    held = hold(grasp, touching, radius_mm, load(mass_kg=0.0, force_N=30.0), _MU)

    assert held.required_force_N == pytest.approx(30.0 / _MU)


def test_an_off_centre_grasp_needs_torsional_friction_for_the_moment_of_the_weight() -> None:
    """The moment f·arm is about the pads' common normal: each pad bears half of it by torsion, and half of f.

    On the ellipsoid (f/2 / μN)² + (f·arm/2 / μN·r)² = 1 with N = F/2: F = √(f² + (f·arm/r)²) / μ, r being the mean distance of
    the patch's points from its centre.
    """
    grasp, touching = two_pads(height_mm=10.0, across_mm=8.0)
    arm_mm, force_N = 25.0, 12.0
    lever = load(mass_kg=0.0, force_N=force_N, centroid=(0.0, arm_mm, 0.0))

    held = hold(grasp, touching, np.inf, lever, _MU)

    torsion_N = force_N * arm_mm / mean_distance(8.0, 10.0)
    assert held.required_force_N == pytest.approx(np.hypot(force_N, torsion_N) / _MU, rel=1e-4)
    assert held.moment_Nmm == pytest.approx(force_N * arm_mm)


def test_a_moment_about_the_cylinder_s_axis_is_held_by_friction_at_its_radius() -> None:
    """Three pads rub with μ·F/3 each at the radius R: μ·F·R; the force itself, at a long arm, counts little."""
    radius_mm, arm_mm, force_N = 20.0, 300.0, 1.0
    grasp, touching = three_pads(radius_mm)
    turned = replace(
        load(mass_kg=0.0, force_N=force_N),
        insertion_C=np.array([[arm_mm, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    )

    held = hold(grasp, touching, radius_mm, turned, _MU)

    assert held.required_force_N == pytest.approx(force_N * arm_mm / radius_mm / _MU, rel=0.1)


def test_the_strip_on_a_cylinder_follows_the_elastic_foundation() -> None:
    """Indented by δ, the strip is a = √(2Rδ) to each side and bears P = k·h·∫(δ − x²/2R)dx = (2/3)·k·h·a³/R (Johnson, 4.3).

    Three strips share the grip force, here that of 1 N along the axis.
    """
    radius_mm, height_mm = 20.0, 10.0
    grasp, touching = three_pads(radius_mm, height_mm)

    held = hold(grasp, touching, radius_mm, load(mass_kg=0.0, force_N=1.0), _MU)

    half = (1.5 * (1.0 / _MU / 3.0) * radius_mm / (PAD.normal_N_mm3 * height_mm)) ** (1.0 / 3.0)
    assert held.contact_area_mm2 == pytest.approx(3.0 * 2.0 * half * height_mm, rel=1e-6)


def test_torsion_on_two_pads_is_held_with_less_force_the_larger_the_cylinder() -> None:
    """The paper, section 3.1: "grasping a cylinder with larger radius is more stable since the contact area is larger"."""
    lever = load(mass_kg=0.2, centroid=(0.0, 15.0, 0.0))
    grasp, touching = two_pads(height_mm=3.0)

    needed = [hold(grasp, touching, radius_mm, lever, _MU).required_force_N for radius_mm in (2.0, 10.0, 50.0)]

    assert needed[0] > needed[1] > needed[2] > 0.0


def test_a_load_across_the_jaws_is_held_by_their_guides_until_one_pad_lifts_off() -> None:
    """The jaws hold F together; one pad gains half the load, the other loses it: F/2 − f/2 ≥ 0."""
    grasp, touching = two_pads()
    across = replace(load(mass_kg=0.0, force_N=30.0), insertion_C=np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))

    held = hold(grasp, touching, np.inf, across, _MU)

    assert held.required_force_N == pytest.approx(30.0)


@pytest.mark.parametrize("arm_mm", [0.0, 2.0, 10.0, 60.0])
@pytest.mark.parametrize(("height_mm", "across_mm"), [(10.0, 8.0), (3.0, 12.0), (6.0, 6.0)])
def test_force_and_torsion_share_a_patch_as_its_ellipsoid_says(arm_mm: float, height_mm: float, across_mm: float) -> None:
    """From rubbing alone to twisting nearly alone, F = f·√(1 + (arm/r)²) / μ for two pads: see the grasp off centre."""
    grasp, touching = two_pads(height_mm=height_mm, across_mm=across_mm)

    held = hold(grasp, touching, np.inf, load(mass_kg=0.0, force_N=10.0, centroid=(0.0, arm_mm, 0.0)), _MU)

    ratio = arm_mm / mean_distance(across_mm, height_mm)
    assert held.required_force_N == pytest.approx(10.0 * np.hypot(1.0, ratio) / _MU, rel=1e-4)


@pytest.mark.parametrize("radius_mm", [4.0, 20.0, 100.0])
def test_the_torsion_that_a_strip_bears_is_that_of_the_strip_which_the_force_itself_makes(radius_mm: float) -> None:
    """A cylinder in two flat fingers, off centre: F = f·√(1 + (arm/r(F))²) / μ, whose strip has the width that F makes.

    Half-width a = ∛(1.5·P·R / (k·h)) with P = F/2, up to a²/2R = the pad's greatest compression. The pressure falls off to the
    strip's sides as 1 − (x/a)²; an even one of √0.6 of the width has the same second moment. Solved by bisection here.
    """
    height_mm, arm_mm, force_N = 10.0, 12.0, 5.0
    grasp, touching = two_pads(height_mm=height_mm)

    def short_of(grip_N: float) -> float:
        half = np.cbrt(1.5 * grip_N / 2.0 * radius_mm / (PAD.normal_N_mm3 * height_mm))
        half = min(half, np.sqrt(2.0 * radius_mm * PAD.compression * PAD.thickness_mm))
        return force_N * np.hypot(1.0, arm_mm / mean_distance(2.0 * half * np.sqrt(0.6), height_mm)) / _MU - grip_N

    held = hold(grasp, touching, radius_mm, load(mass_kg=0.0, force_N=force_N, centroid=(0.0, arm_mm, 0.0)), _MU)

    exact_N = brentq(short_of, 1.0, 10_000.0)
    assert exact_N * (1.0 - 1e-4) <= held.required_force_N <= 1.02 * exact_N


@pytest.mark.parametrize(("mass_kg", "force_N"), [(0.1, 30.0), (1.0, 30.0), (4.0, 30.0)])
def test_a_peg_pushed_in_from_above_needs_the_greater_of_what_carrying_and_pushing_ask(mass_kg: float, force_N: float) -> None:
    """The push meets a force upwards, from which the weight takes off: m·(g + a) while it is carried, f while it is pushed."""
    grasp, touching = two_pads()

    held = hold(grasp, touching, np.inf, load(mass_kg, force_N), _MU)

    carried_N = mass_kg * (GRAVITY_M_S2 + ACCELERATION_M_S2)
    assert held.required_force_N == pytest.approx(max(carried_N, force_N) / _MU)


def test_a_peg_pushed_in_sideways_bears_its_weight_and_the_push_at_right_angles() -> None:
    """Both along the pads: √(f² + (m·g)²) / μ, more than carrying it asks."""
    mass_kg, force_N = 1.0, 30.0
    grasp, touching = two_pads()
    motion = np.tile(np.eye(4), (2, 1, 1))
    motion[0, 1, 3] = 50.0

    held = hold(grasp, touching, np.inf, operation_load(motion, np.eye(4), np.zeros(3), mass_kg, force_N), _MU)

    assert held.required_force_N == pytest.approx(np.hypot(force_N, mass_kg * GRAVITY_M_S2) / _MU)


def test_no_force_holds_surfaces_that_are_squeezed_out() -> None:
    grasp, touching = two_pads()
    tilt = Rotation.from_rotvec([0.0, np.radians(15.0), 0.0]).as_matrix()
    wedge = [
        replace(touching[0], normal_C=tilt @ touching[0].normal_C),
        replace(touching[1], normal_C=tilt.T @ touching[1].normal_C),
    ]

    assert hold(grasp, wedge, np.inf, load(), 0.2).required_force_N == np.inf
    assert np.isfinite(hold(grasp, wedge, np.inf, load(), 0.4).required_force_N)


def test_nothing_holds_without_friction_and_nothing_is_needed_without_load() -> None:
    grasp, touching = two_pads()

    assert hold(grasp, touching, np.inf, load(), 0.0).required_force_N == np.inf
    assert hold(grasp, touching, np.inf, load(mass_kg=0.0), 0.0).required_force_N == 0.0
    assert hold(grasp, touching, 20.0, load(mass_kg=0.0), _MU).required_force_N == 0.0


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("radius_mm", [np.inf, 20.0])
def test_more_mass_force_or_slip_never_needs_less(seed: int, radius_mm: float) -> None:
    rng = np.random.default_rng(seed)
    grasp, touching = two_pads() if seed % 2 else three_pads()
    centroid = tuple(rng.normal(scale=20.0, size=3).tolist())

    def needed(mass_kg: float, force_N: float, friction: float) -> float:
        return hold(grasp, touching, radius_mm, load(mass_kg, force_N, centroid), friction).required_force_N

    masses = [needed(mass, 10.0, _MU) for mass in (0.0, 0.1, 0.5, 1.0, 3.0)]
    forces = [needed(1.0, force, _MU) for force in (0.0, 5.0, 10.0, 20.0, 100.0)]
    frictions = [needed(1.0, 10.0, friction) for friction in (0.6, 0.4, 0.2, 0.1)]

    for figures in (masses, forces, frictions):
        assert (np.diff(figures) >= -1e-6 * np.array(figures[1:])).all(), figures


@pytest.mark.parametrize("seed", range(5))
def test_holding_does_not_depend_on_the_frame(seed: int) -> None:
    rng = np.random.default_rng(seed)
    X = np.eye(4)
    X[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    X[:3, 3] = rng.normal(scale=100.0, size=3)
    grasp, touching = three_pads() if seed % 2 else two_pads()
    before = load(1.0, 25.0, (5.0, -8.0, 12.0))
    R, t = X[:3, :3], X[:3, 3]
    after = replace(
        before,
        centroid_C=R @ before.centroid_C + t,
        gravity_C=before.gravity_C @ R.T,
        insertion_C=np.stack([R @ before.insertion_C[0] + t, R @ before.insertion_C[1]]),
    )
    moved = [replace(item, centre_C=R @ item.centre_C + t, normal_C=R @ item.normal_C) for item in touching]

    here = hold(grasp, touching, 20.0, before, _MU)
    there = hold(replace(grasp, X_CG=X @ grasp.X_CG), moved, 20.0, after, _MU)

    assert there.required_force_N == pytest.approx(here.required_force_N, rel=1e-9)
    assert there.moment_Nmm == pytest.approx(here.moment_Nmm, rel=1e-9)
    assert there.symmetry == pytest.approx(here.symmetry, rel=1e-9)


@pytest.mark.parametrize("seed", range(8))
def test_the_force_is_never_below_what_the_best_distribution_of_friction_needs(seed: int) -> None:
    rng = np.random.default_rng(seed)
    grasp, touching = two_pads(across_mm=6.0) if seed % 2 else _off_centre(three_pads(), rng)
    asked = load(1.0, 20.0, tuple(rng.normal(scale=15.0, size=3).tolist()))

    needed = hold(grasp, touching, np.inf, asked, _MU).required_force_N

    least = max(_least_by_linear_program(touching, wrench) for wrench in _wrenches(asked, touching, grasp))
    assert least * 0.999 <= needed <= 2.0 * least


def test_a_motion_that_tips_the_component_loads_it_with_every_weight_on_the_way() -> None:
    motion = np.tile(np.eye(4), (2, 1, 1))
    motion[0, :3, :3] = Rotation.from_euler("x", 90.0, degrees=True).as_matrix()

    asked = operation_load(motion, np.eye(4), np.zeros(3), 1.0, 0.0)

    angles = np.degrees(np.arctan2(asked.gravity_C[:, 1], -asked.gravity_C[:, 2]))
    assert np.allclose(asked.gravity_C[-1], _DOWN)
    assert sorted(np.abs(angles))[0] == pytest.approx(0.0, abs=1e-6)
    assert np.abs(angles).max() == pytest.approx(90.0, abs=1e-4)
    assert np.diff(np.sort(np.abs(angles))).max() < 10.0
    assert len(load().gravity_C) == 1


def test_the_insertion_force_acts_against_the_end_of_the_motion_seen_from_the_component() -> None:
    X_PC = np.eye(4)
    X_PC[:3, :3] = Rotation.from_euler("y", 90.0, degrees=True).as_matrix()
    motion = np.tile(np.eye(4), (3, 1, 1))
    motion[0, :3, 3] = [0.0, 0.0, 80.0]
    motion[1, :3, 3] = [30.0, 0.0, 0.0]

    asked = operation_load(motion, X_PC, np.zeros(3), 1.0, 10.0, force_point_C=np.array([0.0, 0.0, 7.0]))

    assert np.allclose(X_PC[:3, :3] @ asked.insertion_C[1], [-1.0, 0.0, 0.0])
    assert np.allclose(asked.insertion_C[0], [0.0, 0.0, 7.0])


def test_a_grasp_about_the_insertion_axis_is_symmetric_and_one_beside_it_less() -> None:
    grasp, touching = two_pads(width_mm=40.0)

    centred = hold(grasp, touching, np.inf, load(), _MU).symmetry
    beside = hold(grasp, touching, np.inf, load(centroid=(0.0, 20.0, 5.0)), _MU).symmetry

    assert centred == 1.0
    assert beside == pytest.approx(0.5)


def _grasp(fingers: int, width_mm: float, gripper_type: str) -> Grasp:
    return Grasp(X_CG=np.eye(4), gripper_type=gripper_type, grip=EXTERNAL, opening_width_mm=width_mm)


def _contacts(fingers: int, radius_mm: float, height_mm: float, area_mm2: float) -> list[Contact]:
    angles = 2.0 * np.pi * np.arange(fingers) / fingers
    outward = np.stack([np.cos(angles), np.sin(angles), np.zeros(fingers)], axis=1)
    return [
        Contact(height_mm=height_mm, area_mm2=area_mm2, centre_C=radius_mm * normal, normal_C=normal, gap_mm=0.0)
        for normal in outward
    ]


def _off_centre(held: tuple[Grasp, list[Contact]], rng: np.random.Generator) -> tuple[Grasp, list[Contact]]:
    """The contacts moved a little along the axis, as real patches are."""
    grasp, touching = held
    return grasp, [replace(item, centre_C=item.centre_C - rng.uniform(-1.0, 1.0) * _DOWN) for item in touching]


def _wrenches(asked: Load, touching: list[Contact], grasp: Grasp) -> FloatArray:
    """Those wrenches whose forces are greatest, and the insertion's: enough for a lower bound."""
    middle = np.mean([item.centre_C for item in touching], axis=0)
    every = wrenches(asked, middle, grasp.X_CG[:3, :3])
    return np.concatenate([every[np.argsort(-np.linalg.norm(every[:, 3:], axis=1))[:5]], every[-2:]])


def _least_by_linear_program(touching: list[Contact], wrench: FloatArray) -> float:
    """Least sum of normal forces, friction ellipsoid and tilting rectangle replaced by polytopes around them (a lower bound)."""
    middle = np.mean([item.centre_C for item in touching], axis=0)
    sides = np.concatenate([Rotation.random(120, random_state=0).as_matrix()[:, 0], np.eye(3), -np.eye(3)])
    columns, rows = [], []
    for index, item in enumerate(touching):
        inward, along = -item.normal_C, np.array([0.0, 0.0, 1.0])
        across, arm = np.cross(inward, along), item.centre_C - middle
        axes = (inward, along, across)
        columns += [np.concatenate([axis, np.cross(arm, axis)]) for axis in axes]
        columns += [np.concatenate([np.zeros(3), axis]) for axis in axes]
        width = item.area_mm2 / item.height_mm
        block = np.zeros((len(sides) + 4, 6 * len(touching)))
        block[:, 6 * index] = -1.0
        block[: len(sides), 6 * index + 1 : 6 * index + 4] = sides / _MU / [1.0, 1.0, mean_distance(width, item.height_mm)]
        for row, (figure, limit) in enumerate(
            [(4, width / 3.0), (4, -width / 3.0), (5, item.height_mm / 3.0), (5, -item.height_mm / 3.0)]
        ):
            block[len(sides) + row, 6 * index + figure] = 1.0 / limit
        rows.append(block)
    cost = np.tile([1.0, 0, 0, 0, 0, 0], len(touching))
    bounds = [(0.0, None) if figure % 6 == 0 else (None, None) for figure in range(6 * len(touching))]
    solution = linprog(
        cost, A_ub=np.vstack(rows), b_ub=np.zeros(len(np.vstack(rows))), A_eq=np.array(columns).T, b_eq=-wrench, bounds=bounds
    )
    assert solution.success
    return float(solution.fun)


@pytest.mark.parametrize(("hardness", "modulus_MPa"), [(50.0, 2.46), (60.0, 3.61), (70.0, 5.52)])
def test_the_pads_modulus_follows_gents_relation(hardness: float, modulus_MPa: float) -> None:
    """Gent's E (MPa) = 0.0981 (56 + 7.62336 S) / (0.137505 (254 − 2.54 S)), worked out by hand."""
    assert Pad(hardness_shore_A=hardness).modulus_MPa == pytest.approx(modulus_MPa, abs=0.01)


def test_a_thicker_pad_makes_wider_strips() -> None:
    """P = k (2/3) a³ h / R with k ∝ 1/t: twice the thickness widens the strip by the cube root of two."""
    grasp, touching = three_pads(height_mm=20.0)
    light = load(mass_kg=0.0, force_N=1.0)

    areas = [hold(grasp, touching, 20.0, light, _MU, Pad(thickness_mm=t)).contact_area_mm2 for t in (1.0, 2.0)]

    assert areas[1] / areas[0] == pytest.approx(2.0 ** (1.0 / 3.0), rel=1e-6)


@pytest.mark.parametrize(("bore_mm", "height_mm"), [(5.0, 8.0), (10.0, 5.0), (20.0, 10.0)])
@pytest.mark.parametrize("centroid", [(0.0, 0.0, 0.0), (0.0, 20.0, 5.0), (10.0, 0.0, -25.0)])
def test_a_line_asks_for_little_more_force_than_a_padded_nose(
    bore_mm: float, height_mm: float, centroid: tuple[float, float, float]
) -> None:
    grasp, touching = three_pads(bore_mm, height_mm)
    asked = load(centroid=centroid)

    line, padded = (hold(grasp, touching, radius, asked, _MU).required_force_N for radius in (0.01, 1 / (1 / 4.0 - 1 / bore_mm)))

    assert padded <= line * (1.0 + 1e-9) <= padded * 1.01
