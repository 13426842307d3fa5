"""Whether a STEP file was read whole: Open CASCADE leaves out what it cannot make, and says so only where it is asked."""

from collections.abc import Iterator
from typing import Any

from OCP.StepShape import StepShape_Face

from gripwright.domain.errors import InvalidGeometry

_NEEDED = (  # what shape, place or structure hang on; the fault of a colour or of a dimension does no harm
    "StepShape_",
    "StepGeom_",
    "StepBasic_Product",
    "StepBasic_ConversionBasedUnit",
    "StepBasic_SiUnit",
    "StepRepr_NextAssemblyUsageOccurrence",
    "StepRepr_ItemDefinedTransformation",
    "StepRepr_ProductDefinitionShape",
    "StepRepr_ShapeRepresentation",
    "StepRepr_RepresentationRelationship",
    "StepRepr_GlobalUnitAssignedContext",
)
_SHOWN = 200  # characters of a reason


def check_entities(reader: Any) -> None:
    """InvalidGeometry where entities refer to what is not there, or those of the shape are damaged. After `Read`."""
    model = reader.Reader().WS().Model()
    structure = model.GlobalCheck(True)
    if structure.NbFails():
        raise InvalidGeometry(f"is damaged: faults of its structure: {structure.NbFails()}, the first is: {_said(structure)}")
    damaged = [k for k in range(1, model.NbEntities() + 1) if model.IsErrorEntity(k) and _is_needed(model.Value(k))]
    if not damaged:
        return
    name = type(model.Value(damaged[0])).__name__.partition("_")[2]
    check = model.ReportEntity(damaged[0]).Check()
    reason = f": {_said(check)}" if check.NbFails() else ""
    faces = sum(isinstance(model.Value(k), StepShape_Face) for k in damaged)
    parts = f"entities of its shape that cannot be read: {len(damaged)}, {faces} of its {_count_faces(model)} faces among them"
    raise InvalidGeometry(f"is damaged; {parts}. The first is of type {name}{reason}")


def check_faces(reader: Any, faces_read: int) -> None:
    """InvalidGeometry where less came of the file than it holds. After `Transfer`, with the count of the faces of all parts."""
    work = reader.Reader().WS()
    faces = _count_faces(work.Model())
    fails = list(_fails(work.TransferReader().TransientProcess().CheckList(False)))
    if faces_read < faces or fails:
        reason = f", the first failure is: {_said(fails[0])}" if fails else ""
        raise InvalidGeometry(f"is read in part alone: {faces_read} of its {faces} faces{reason}")


def _count_faces(model: Any) -> int:
    return sum(isinstance(model.Value(k), StepShape_Face) for k in range(1, model.NbEntities() + 1))


def _is_needed(entity: Any) -> bool:
    return type(entity).__name__.startswith(_NEEDED)


def _fails(checks: Any) -> Iterator[Any]:
    checks.Start()
    while checks.More():
        if checks.Value().NbFails():
            yield checks.Value()
        checks.Next()


def _said(check: Any) -> str:
    return str(check.CFail(1)).strip()[:_SHOWN]
