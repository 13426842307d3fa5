"""Flat faces of ferrous components are held by a magnet."""

from collections.abc import Sequence
from typing import Annotated, ClassVar

from pydantic import Field

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import GripRequirement
from gripwright.domain.shape import Primitive
from gripwright.plugin_api import Params
from gripwright_vacuum.face_sizes import face_requirements
from gripwright_vacuum.gripper_types import MAGNETIC_1

Size = Annotated[float, Field(ge=6.0, le=150.0)]


class MagneticFaceSettings(Params):
    """Which pole faces are made."""

    sizes: tuple[Size, ...] = Field((12.0, 20.0, 32.0, 50.0), min_length=1, description="mm, diameters of pole faces")


class MagneticFace:
    """Ask for a pole face of each size that a primitive's flat faces have room for, the largest first.

    Whether the component is ferrous the holding model knows; a rule sees the primitive alone.
    """

    key: ClassVar[str] = "magnetic_face"
    params_model: ClassVar[type[Params]] = MagneticFaceSettings
    accepts: ClassVar[frozenset[str]] = frozenset({"*"})

    def __init__(self, params: MagneticFaceSettings) -> None:
        self._params = params

    def apply(self, fit: Primitive) -> Sequence[GripRequirement] | Rejection:
        """A requirement a size; `no-type` for a bore, and where the smallest face is too large."""
        return face_requirements(fit, MAGNETIC_1, self._params.sizes, self.key)
