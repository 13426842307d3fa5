"""Flat faces are held by a suction cup."""

from collections.abc import Sequence
from typing import Annotated, ClassVar

from pydantic import Field

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import GripRequirement
from gripwright.domain.shape import Primitive
from gripwright.plugin_api import Params
from gripwright_vacuum.face_sizes import face_requirements
from gripwright_vacuum.gripper_types import VACUUM_1
from gripwright_vacuum.vacuum.cup import STANDARD_MM

Size = Annotated[float, Field(ge=5.0, le=150.0)]


class VacuumFaceSettings(Params):
    """Which cups there are."""

    sizes: tuple[Size, ...] = Field(STANDARD_MM, min_length=1, description="mm, diameters of the cups that may be chosen")


class VacuumFace:
    """Ask for a suction cup of each size that a primitive's flat faces have room for, the largest first."""

    key: ClassVar[str] = "vacuum_face"
    params_model: ClassVar[type[Params]] = VacuumFaceSettings
    accepts: ClassVar[frozenset[str]] = frozenset({"*"})

    def __init__(self, params: VacuumFaceSettings) -> None:
        self._params = params

    def apply(self, fit: Primitive) -> Sequence[GripRequirement] | Rejection:
        """A requirement a size; `no-type` for a bore, and where the smallest cup is too large."""
        return face_requirements(fit, VACUUM_1, self._params.sizes, self.key)
