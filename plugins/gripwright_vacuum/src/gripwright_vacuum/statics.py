"""With which force a round face has to be pressed on, to hold against pull, tilting, shear and torsion together.

The component presses against the face with N = F − f, F being what draws it there and f what pulls it off. It stays on all round
as long as the moment is at most N times the core's radius (of a thin ring half its radius, of a disc a quarter), and in its place
as long as shear t and torsion τ lie within (t / μN)² + (τ / μNa)² ≤ 1 (Howe and Cutkosky, Practical force-motion models for
sliding manipulation, 1996), a being the radius at which the pressure acts.
"""

import numpy as np

from gripwright.domain.grasp import Grasp, Hold
from gripwright.domain.holding import Contact, Load
from gripwright.geometry.wrenches import wrenches

RING_CORE, DISC_CORE = 0.5, 0.25
"""Radius of the core of a thin ring and of a disc, as a share of their own."""


def needed_hold(
    grasp: Grasp, contact: Contact, load: Load, friction: float, *, radius_mm: float, core: float, factor: float
) -> Hold:
    """What the face has to hold with: the least force F of all that the load asks, times `factor`."""
    asked = wrenches(load, contact.centre_C, grasp.X_CG[:3, :3])  # (k, 6) on the component
    force, moment = asked[:, :3] @ grasp.X_CG[:3, :3], asked[:, 3:] @ grasp.X_CG[:3, :3]  # (k, 3) seen from G
    tilting = np.hypot(moment[:, 0], moment[:, 1]) / (core * radius_mm)
    sliding = np.hypot(np.hypot(force[:, 0], force[:, 1]), moment[:, 2] / radius_mm) / friction
    needed_N = max(0.0, float((force[:, 2] + np.maximum(tilting, sliding)).max()))
    point, direction = load.insertion_C
    off_axis = float(np.linalg.norm(np.cross(contact.centre_C - point, direction)))
    return Hold(
        required_force_N=factor * needed_N,
        moment_Nmm=float(np.linalg.norm(asked[:, 3:], axis=1).max()),
        symmetry=radius_mm / (radius_mm + off_axis),
        contact_area_mm2=contact.area_mm2,
    )
