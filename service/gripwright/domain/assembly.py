"""The assembly task: components, obstacles and the sequence of operations. Lengths in mm, product frame P, +z up."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from gripwright.domain.later import LATER
from gripwright.domain.shape import FloatArray, Mesh

Texture = Literal["smooth", "machined", "rough", "porous"]
"""How tight a surface is against a lip: polished; turned, milled or moulded; cast or sawn; sintered, foamed or wooden."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GraspRegion:
    """A region of a component that may not be touched, or may be in spite of what was detected.

    Either a box in the component's frame (closed bounds) or segment numbers of an earlier analysis.
    """

    reason: str
    box_min_C: FloatArray | None = None  # (3,)
    box_max_C: FloatArray | None = None  # (3,)
    segments: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Component:
    """A component of the product; `X_PC` places its mesh (frame C) in the finished product (frame P)."""

    id: str
    mesh: Mesh
    X_PC: FloatArray  # (4, 4)
    part_number: str = ""
    revision: str = ""
    name: str = ""
    density_kg_m3: float = 7850.0
    friction: float = 0.2
    texture: Texture | None = field(default=None, metadata=LATER)  # None: not known
    ferrous: bool | None = field(default=None, metadata=LATER)  # whether a magnet holds it; None: not known
    no_grasp: tuple[GraspRegion, ...] = ()
    may_grasp: tuple[GraspRegion, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Obstacle:
    """A fixture or support that stands around: in all operations, or in those named."""

    id: str
    mesh: Mesh
    X_PE: FloatArray  # (4, 4)
    operations: tuple[str, ...] | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Operation:
    """The paper's ⟨c_a, c_p, ᵃT_p, ᵃ'T_p⟩.

    `motion` displaces the active subassembly from its place in the product frame: first pose_before, then the waypoints,
    last pose_after. Between neighbours the subassembly makes a screw motion of less than 180°.
    """

    id: str
    active: tuple[str, ...]
    passive: tuple[str, ...]
    motion: FloatArray  # (k >= 2, 4, 4)
    grasp: str | None = None  # the component to hold, None: any of `active`
    force_N: float = 0.0  # insertion force
    fit: str | None = None  # "clearance", "press", …

    @property
    def graspable(self) -> tuple[str, ...]:
        """The components that the gripper may hold."""
        return (self.grasp,) if self.grasp is not None else self.active


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AssemblyTask:
    """A product and its assembly sequence."""

    part_number: str
    revision: str
    name: str
    components: tuple[Component, ...]
    obstacles: tuple[Obstacle, ...]
    operations: tuple[Operation, ...]
    warnings: tuple[str, ...] = ()

    def component(self, component_id: str) -> Component:
        """The component of that id; KeyError where there is none."""
        for component in self.components:
            if component.id == component_id:
                return component
        raise KeyError(component_id)


IDENTITY: FloatArray = np.eye(4)
IDENTITY.setflags(write=False)
