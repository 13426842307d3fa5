"""What holding a component asks of the gripper: friction of soft fingertips against the loads of an operation (paper, 5.4).

Contacts are patches of a thin elastic pad, which flat fingers carry. Its elastic foundation (Johnson, Contact Mechanics, 1985,
section 4.3) gives the width of the strip on a curved surface from the relative curvature (Harada et al., Stability of soft-finger
grasp based on contact area, 2014; Ciocarlie et al., Soft finger model with adaptive contact geometry, 2007), and how the contacts
share a load. A patch slips outside the ellipsoid (f / μN)² + (τ / μN·r)² = 1 (Howe and Cutkosky, Practical force-motion models
for sliding manipulation, 1996), r being the mean distance of its pressure from its centre.

The actuator keeps the sum of the forces towards its axis, the grip force F; its guides carry their differences. Between tapered
tips (`domain.taper`) these are not the normal forces, which push the component along the axis besides: friction has to hold that,
too, and it slips out where the taper is steeper than friction. A finger with a V (`domain.v_tip`) touches with two flanks, one
contact each, whose normals are turned from the way that it closes: it wedges, and the normal forces are greater than F. How the
flanks have rubbed as they closed is left out of account: that is balanced in itself, and what of it hinders a load slips.
The elastic distribution is one that friction may choose: F, at which the first contact slips, is never below the least force that
any distribution needs, and was at most twice that in tests.
"""

from collections.abc import Sequence

import numpy as np

from gripwright.design.gripping_surface import GrippingSurface
from gripwright.domain.grasp import Grasp, Hold
from gripwright.domain.holding import Contact, Load
from gripwright.domain.pad import PAD, Pad
from gripwright.domain.shape import CurvedPrimitive, FloatArray, Primitive
from gripwright.geometry.wrenches import wrenches

_TILT = 1.0 / 3.0  # of a patch's extent: how far the pressure's resultant may shift, so that at least half stays pressed
_PARABOLA = np.sqrt(0.6)  # width of the even pressure whose second moment is that of a parabolic one, as its share
_STEPS = 2  # towards the force whose own patch needs just that force
_STEP = 1.0 / 1.2  # of the logarithm: a patch's torsion grows with about the fifth root of the force
_NARROWEST_MM = 0.01
_UPRIGHT = 1e-6  # sine of the angle between gripping surface and axis that rounding makes


def contact_radius_mm(primitive: Primitive, gripping: GrippingSurface, pad: Pad = PAD) -> float:
    """Radius of the relative curvature of a surface and the pad on it; inf for a plane on a flat finger.

    Curvatures add up: 1/R of a cylinder, −1/r of a groove. A cylinder that nearly fills its groove counts as no wider than the
    finger. A nose carries no pad: it is reckoned as an edge, which touches along a line.
    """
    surface = primitive.contact_radius_mm if isinstance(primitive, CurvedPrimitive) else np.inf
    if not np.isfinite(gripping.radius_mm):
        return surface
    if gripping.radius_mm > 0.0:
        return _NARROWEST_MM
    widest = (gripping.y_range[1] - gripping.y_range[0]) ** 2 / (8.0 * pad.compression * pad.thickness_mm)
    curvature = 1.0 / surface + 1.0 / gripping.radius_mm
    return min(1.0 / curvature, widest) if curvature > 0.0 else widest


def hold(grasp: Grasp, touching: Sequence[Contact], radius_mm: float, load: Load, friction: float, pad: Pad = PAD) -> Hold:
    """The least grip force that holds all wrenches of `load`; inf where none does. `radius_mm` as `contact_radius_mm` says."""
    centres = np.array([contact.centre_C for contact in touching])  # (n, 3)
    middle = centres.mean(axis=0)
    loads = wrenches(load, middle, grasp.X_CG[:3, :3])  # (k, 6)
    patches = _Patches(touching, centres - middle, grasp.X_CG[:3, 2], radius_mm, pad)
    force_N = 0.0 if not loads.any() else np.inf if friction <= 0.0 else _least_force_N(patches, loads, friction)
    point, direction = load.insertion_C
    off_axis = float(np.linalg.norm(np.cross(middle - point, direction)))
    span = float(np.linalg.norm(centres - middle, axis=1).max())
    return Hold(
        required_force_N=force_N,
        moment_Nmm=float(np.linalg.norm(loads[:, 3:], axis=1).max()),
        symmetry=span / (span + off_axis) if span + off_axis > 0.0 else 1.0,
        contact_area_mm2=patches.area_mm2(force_N),
    )


def _least_force_N(patches: "_Patches", loads: FloatArray, friction: float) -> float:
    """The force whose own patches need just that force; patches widen with it, so less is needed the more there is."""
    if np.linalg.matrix_rank(patches.grip_map) < len(patches.grip_map):
        return float("inf")  # there are wrenches that these contacts do not answer at all
    force = _needed_N(patches, np.inf, loads, friction)
    if not patches.curved or not np.isfinite(force):
        return force
    for _ in range(_STEPS):
        force *= (_needed_N(patches, force, loads, friction) / force) ** _STEP
    return max(force, _needed_N(patches, force, loads, friction))


def _needed_N(patches: "_Patches", pressed_N: float, loads: FloatArray, friction: float) -> float:
    """Grip force that holds the loads with the patches that `pressed_N` makes."""
    count, total = len(patches.heights), float(patches.slopes.sum())
    widths = patches.widths_mm(pressed_N)
    grip, stiffness = patches.grip_map, patches.stiffness(widths)
    gain = stiffness[:, None] * grip.T  # (6n, 7)
    coupling = grip @ gain  # (7, 7)
    squeeze = grip[:, 0::6].sum(axis=1) / total  # (7,) wrench of the contacts pressed evenly with a grip force of 1 N
    squeeze[6] = 0.0
    asked = -np.vstack([squeeze, patches.scaled(loads)])  # (1 + k, 7)
    answer = (asked @ np.linalg.solve(coupling, gain.T)).reshape(len(asked), count, 6)  # the elastic answer
    normal = answer[..., 0]  # beside the even share
    slip = answer[..., 1:4] / friction  # (…, n, 3)
    slip[..., 2] /= _mean_distance(widths, patches.heights) / patches.span
    tilt = answer[..., 4:6] * patches.span / (_TILT * np.stack([widths, patches.heights], axis=-1))
    each = normal[0] + 1.0 / total  # (n,) normal force by grip force
    return max(0.0, _friction_bound(each, slip, normal[1:]), _tilt_bound(each, tilt, normal[1:]))


def _friction_bound(each: FloatArray, slip: FloatArray, normal: FloatArray) -> float:
    """Least F with |slip of the load + F · slip of the squeeze| ≤ each · F + normal at every contact."""
    squeeze, load = slip[0], slip[1:]
    a = each**2 - (squeeze**2).sum(axis=-1)
    if (a <= 1e-12).any() or (each <= 0.0).any():
        return float("inf")
    b = each * normal - (load * squeeze).sum(axis=-1)
    c = normal**2 - (load**2).sum(axis=-1)
    return float(((np.sqrt(np.maximum(b**2 - a * c, 0.0)) - b) / a).max())


def _tilt_bound(each: FloatArray, tilt: FloatArray, normal: FloatArray) -> float:
    """Least F with |tilt of the load + F · tilt of the squeeze| ≤ each · F + normal at every contact, about both axes."""
    bounds = []
    for sign in (1.0, -1.0):
        rest = each[:, None] - sign * tilt[0]  # (n, 2)
        if (rest <= 1e-12).any():
            return float("inf")
        bounds.append(((sign * tilt[1:] - normal[..., None]) / rest).max())
    return float(max(bounds))


def _mean_distance(width: FloatArray, height: FloatArray) -> FloatArray:
    """Mean distance of a rectangle's points from its centre."""
    a, b = width / 2.0, height / 2.0
    d = np.hypot(a, b)
    return np.asarray(d / 3.0 + a**2 / (6.0 * b) * np.log((b + d) / a) + b**2 / (6.0 * a) * np.log((a + d) / b))


class _Patches:
    """The contacts as rectangular patches of pads, `heights` along the gripping surface. Moments are divided by `span`.

    Each contact answers with six figures: normal force, friction along the height and across, torque about the normal,
    moments of its pressure about the height and about the width.
    """

    def __init__(
        self, touching: Sequence[Contact], arms: FloatArray, height_axis: FloatArray, radius_mm: float, pad: Pad
    ) -> None:
        inward = -np.array([contact.normal_C for contact in touching])  # (n, 3)
        thrust = inward @ height_axis  # (n,) of a normal force along the gripper's axis
        thrust[np.abs(thrust) < _UPRIGHT] = 0.0
        upright = np.sqrt(1.0 - thrust**2)
        self.heights: FloatArray = np.array([max(contact.height_mm, _NARROWEST_MM) for contact in touching]) / upright
        self._flat = np.array([contact.area_mm2 for contact in touching]) / self.heights
        self._radius, self._pad = radius_mm, pad
        self.curved = bool(np.isfinite(radius_mm))
        self.span = max(float(np.linalg.norm(arms, axis=1).max()), float(self.heights.max()))
        along = height_axis - inward * (inward @ height_axis)[:, None]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        across = np.cross(inward, along)
        columns = np.zeros((len(arms), 6, 7))  # (contact, figure, wrench and force towards the gripper's axis)
        for figure, axis in enumerate((inward, along, across)):
            columns[:, figure, :3] = axis
            columns[:, figure, 3:6] = np.cross(arms, axis) / self.span
        for figure, axis in enumerate((inward, along, across), start=3):
            columns[:, figure, 3:6] = axis
        if touching[0].closing_C is None:
            columns[:, 0, 6], columns[:, 1, 6] = upright, 0.0 - thrust
        else:
            closing = np.array([contact.closing_C for contact in touching])  # (n, 3)
            columns[:, :3, 6] = np.einsum("fni,ni->nf", np.array([inward, along, across]), closing)
        self.slopes: FloatArray = columns[:, 0, 6].copy()  # of normal forces along the way that their fingers close
        self._room = np.array([contact.room_mm for contact in touching])
        self.grip_map: FloatArray = columns.reshape(-1, 7).T  # (7, 6n)

    def scaled(self, loads: FloatArray) -> FloatArray:
        """Wrenches (k, 6) as rows of the grip map: moments by span, no change of the grip force."""
        return np.hstack([loads[:, :3], loads[:, 3:] / self.span, np.zeros((len(loads), 1))])

    def widths_mm(self, force_N: float) -> FloatArray:
        """Widths of patches of even pressure, (n,)."""
        return self._strips_mm(force_N) * _PARABOLA if self.curved else np.maximum(self._flat, _NARROWEST_MM)

    def area_mm2(self, force_N: float) -> float:
        """Area of all patches when the grip force presses them."""
        widths = self._strips_mm(force_N) if self.curved else self._flat
        return float((widths * self.heights).sum())

    def stiffness(self, widths: FloatArray) -> FloatArray:
        """Stiffness of each figure of each contact, (6n,), moments by span."""
        area = widths * self.heights
        about_height, about_width = area * widths**2 / 12.0, area * self.heights**2 / 12.0
        k, g = self._pad.normal_N_mm3, self._pad.shear_N_mm3
        turning = np.stack([g * (about_height + about_width), k * about_height, k * about_width], axis=1) / self.span**2
        return np.asarray(np.hstack([np.stack([k * area, g * area, g * area], axis=1), turning]).ravel())

    def _strips_mm(self, force_N: float) -> FloatArray:
        """Widths of the strips on a cylinder: P = k·(2/3)·a³·h / R, up to the pad's greatest compression a² / 2R."""
        pad = self._pad
        widest = np.sqrt(2.0 * self._radius * pad.compression * pad.thickness_mm)
        each = force_N / float(self.slopes.sum())
        half = np.cbrt(1.5 * each * self._radius / (pad.normal_N_mm3 * self.heights))
        return np.asarray(np.minimum(2.0 * np.clip(half, _NARROWEST_MM, widest), np.maximum(self._room, _NARROWEST_MM)))
