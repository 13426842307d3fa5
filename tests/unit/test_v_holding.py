"""What two fingers with a V hold, against closed forms and an independent linear programme over Coulomb's cones."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq, linprog

from gripwright.design.holding import hold
from gripwright.domain.grasp import EXTERNAL, PARALLEL_2, Grasp
from gripwright.domain.holding import Contact, Load
from gripwright.domain.pad import PAD
from gripwright.domain.shape import FloatArray
from gripwright.geometry.wrenches import wrenches

RADIUS_MM, HEIGHT_MM = 8.0, 9.0
GRASP = Grasp(X_CG=np.eye(4), gripper_type=PARALLEL_2, grip=EXTERNAL, opening_width_mm=10.0)


def four_lines(angle_degrees: float, taper_degrees: float = 0.0, height_mm: float = HEIGHT_MM) -> list[Contact]:
    """Two V about a cylinder or cone along z; component frame = gripper frame, whose z is the way of the tips."""
    turn, taper = np.radians((180.0 - angle_degrees) / 2.0), np.radians(taper_degrees)
    found = []
    for closing in (-1.0, 1.0):
        for aside in (-1.0, 1.0):
            radial = np.array([-closing * np.cos(turn), aside * np.sin(turn), 0.0])
            found.append(
                Contact(
                    height_mm=height_mm,
                    area_mm2=2.0 * height_mm,
                    centre_C=RADIUS_MM * radial,
                    normal_C=radial * np.cos(taper) + [0.0, 0.0, np.sin(taper)],
                    gap_mm=0.0,
                    closing_C=np.array([closing, 0.0, 0.0]),
                    room_mm=2.0,
                )
            )
    return found


def pushed(force: FloatArray, at: FloatArray) -> Load:
    """A force on the component, and no weight."""
    size = float(np.linalg.norm(force))
    return Load(
        mass_kg=0.0, force_N=size, centroid_C=np.zeros(3), gravity_C=np.array([[0.0, 0.0, -1.0]]),
        insertion_C=np.array([at, -force / size]),
    )  # fmt: skip


def needed_N(touching: list[Contact], load: Load, friction: float) -> float:
    return hold(GRASP, touching, RADIUS_MM, load, friction).required_force_N


@pytest.mark.parametrize("angle", [90.0, 120.0, 150.0])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_v_wedges_so_that_a_load_along_a_cylinder_takes_less_force_than_between_flat_tips(angle: float, sign: float) -> None:
    """Each of four flanks is pressed with N = F / (4 cos θ), θ between its normal and the way of the fingers: 4 μN ≥ P."""
    turn, load = np.radians((180.0 - angle) / 2.0), pushed(np.array([0.0, 0.0, sign * 30.0]), np.zeros(3))

    assert needed_N(four_lines(angle), load, 0.2) == pytest.approx(30.0 * np.cos(turn) / 0.2, rel=1e-6)


@pytest.mark.parametrize("angle", [90.0, 120.0])
@pytest.mark.parametrize("taper", [-8.0, 8.0])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_tapered_v_holds_a_load_along_a_cone_as_a_wedge_does_in_both_directions(
    angle: float, taper: float, sign: float
) -> None:
    """Pressed evenly with N₀ the flanks push the cone out; it gives way by w and the fingers by δ until friction holds both."""
    turn, tau, friction, force = np.radians((180.0 - angle) / 2.0), np.radians(taper), 0.3, sign * 30.0
    c, s, ct, st_, g = np.cos(turn), np.sin(turn), np.cos(tau), np.sin(tau), PAD.shear_N_mm3 / PAD.normal_N_mm3
    normal, along, across = np.array([c * ct, st_]), g * np.array([c * st_, -ct]), g * np.array([s, 0.0])  # by (δ, w)
    closing, axial = 4.0 * (c * ct * normal + c * st_ * along + s * across), 4.0 * (-st_ * normal + ct * along)

    def lacking(grip_N: float) -> float:
        even = grip_N / (4.0 * c * ct)
        moved = np.linalg.solve(np.array([closing, axial]), [0.0, 4.0 * even * st_ - force])
        return float(np.hypot(along @ moved, across @ moved) - friction * (even + normal @ moved))

    found = needed_N(four_lines(angle, taper), pushed(np.array([0.0, 0.0, force]), np.zeros(3)), friction)

    assert found == pytest.approx(brentq(lacking, 1.0, 5000.0), rel=1e-6)
    tan, helped = abs(np.tan(tau)), sign * taper > 0.0  # flanks press a component of a positive taper towards −z
    ideal = (1.0 - friction * tan) / (friction + tan) if helped else (1.0 + friction * tan) / (friction - tan)
    assert found == pytest.approx(30.0 * c * ideal, rel=0.05)  # 4 cos θ (N cos τ ∓ μN sin τ) = F where nothing rubs across


@pytest.mark.parametrize(("friction", "held"), [(0.20, False), (0.22, True)])
@pytest.mark.parametrize("taper", [-12.0, 12.0])
def test_what_is_steeper_than_friction_slips_out_of_a_v_as_well(taper: float, friction: float, held: bool) -> None:
    """tan 12° = 0.2126: the V presses harder, and out of it just as much harder."""
    load = pushed(np.array([0.0, 1.0, 1.0]), np.zeros(3))

    assert bool(np.isfinite(needed_N(four_lines(120.0, taper), load, friction))) is held


@pytest.mark.parametrize("angle", [90.0, 120.0])
def test_torque_about_the_axis_is_held_by_friction_at_the_radius(angle: float) -> None:
    """4 μN R = M with N = F / (4 cos θ); the force of the couple is a thousandth of it, and the strips twist a little besides."""
    turn, arm = np.radians((180.0 - angle) / 2.0), 8000.0
    load = pushed(np.array([0.0, 0.1, 0.0]), np.array([arm, 0.0, 0.0]))

    bound = 0.1 * arm * np.cos(turn) / (0.2 * RADIUS_MM)
    assert 0.9 * bound <= needed_N(four_lines(angle), load, 0.2) <= bound * 1.01


def test_a_load_across_the_fingers_is_held_by_the_flanks_themselves_where_flat_tips_need_friction_alone() -> None:
    """Steep flanks (θ = 45°) take a load across the fingers with little friction: four flat contacts need P / μ."""
    load = pushed(np.array([0.0, 30.0, 0.0]), np.zeros(3))

    found = needed_N(four_lines(90.0), load, 0.1)

    assert found <= 2.0 * 30.0 < 30.0 / 0.1


def least_force_N(touching: list[Contact], wrench: FloatArray, friction: float, width_mm: float) -> float:
    """The least grip force of any distribution: each contact may press and rub at the corners and in the middle of its patch.

    Coulomb's cones are replaced by pyramids around them (a lower bound); inf where no force holds.
    """
    middle = np.mean([item.centre_C for item in touching], axis=0)
    sides = 2.0 * np.pi * np.arange(24) / 24
    columns, cost = [], []
    for item in touching:
        inward = -item.normal_C
        along = np.array([0.0, 0.0, 1.0]) - inward * inward[2]
        along /= np.linalg.norm(along)
        across = np.cross(inward, along)
        height = item.height_mm / np.sqrt(1.0 - inward[2] ** 2)
        for u, v in ((0.0, 0.0), (0.5, 0.5), (0.5, -0.5), (-0.5, 0.5), (-0.5, -0.5)):
            arm = item.centre_C + u * height * along + v * width_mm * across - middle
            for side in sides:
                ray = inward + friction / np.cos(np.pi / 24) * (np.cos(side) * along + np.sin(side) * across)
                columns.append(np.concatenate([ray, np.cross(arm, ray)]))
                assert item.closing_C is not None
                cost.append(ray @ item.closing_C)
    solution = linprog(cost, A_eq=np.array(columns).T, b_eq=-wrench, bounds=(0.0, None))
    return float(solution.fun) if solution.success else float("inf")


unit = st.floats(-1.0, 1.0)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(
    angle=st.floats(80.0, 155.0),
    slope=st.floats(-0.4, 0.4),  # of the taper, as a share of friction
    friction=st.floats(0.15, 0.6),
    force=st.tuples(unit, unit, unit),
    at=st.tuples(unit, unit, unit),
    reach_mm=st.floats(0.0, 12.0),
)
def test_the_force_holds_and_is_a_few_times_at_the_most_what_the_best_distribution_of_friction_needs(
    angle: float,
    slope: float,
    friction: float,
    force: tuple[float, float, float],
    at: tuple[float, float, float],
    reach_mm: float,
) -> None:
    """Whatever pushes where, of either sign of taper: nothing that keeps to Coulomb's law needs less than the linear programme,
    which may press each patch at its corners alone."""
    push = np.array(force) * 20.0
    if np.linalg.norm(push) < 1.0:
        push = np.array([0.0, 0.0, 20.0])
    touching = four_lines(angle, float(np.degrees(np.arctan(slope * friction))))
    load = pushed(push, np.array(at) * reach_mm)

    found = hold(GRASP, touching, RADIUS_MM, load, friction)

    width = found.contact_area_mm2 / sum(item.height_mm / np.sqrt(1.0 - item.normal_C[2] ** 2) for item in touching)
    asked = wrenches(load, np.mean([item.centre_C for item in touching], axis=0), np.eye(3))
    least = max(least_force_N(touching, wrench, friction, width) for wrench in asked if np.abs(wrench).max() > 1e-9)
    assert least * 0.999 <= found.required_force_N <= 6.0 * least
