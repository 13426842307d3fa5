"""An assembly sequence given apart from its product. Imports no mesh library."""

from collections.abc import Collection, Iterable
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from gripwright.cad.document import checked_entries, faults_of, parse_json, pointer, refuse
from gripwright.cad.limits import Limits
from gripwright.cad.manifest import MAX_OPERATIONS, OperationEntry
from gripwright.cad.sequence import entries, sequence_faults
from gripwright.domain.assembly import Operation


class OperationsDocument(BaseModel):
    """`{"operations": […]}`, as in product.json."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    operations: tuple[OperationEntry, ...] = Field(max_length=MAX_OPERATIONS)


def validate_operations(value: Any, component_ids: Collection[str]) -> tuple[OperationEntry, ...]:
    """The checked operations of a JSON value, `{"operations": […]}` or the list alone.

    InvalidInput names every fault; pointers begin with /operations in both forms.
    """
    value = {"operations": value} if isinstance(value, list) else value
    checked, faults = checked_entries(value, {"operations": (OperationEntry, MAX_OPERATIONS)})
    known = (pointer("operations"),) if faults else ()
    faults += sequence_faults(entries(value, "operations"), component_ids)
    try:
        document = OperationsDocument.model_validate(checked)
    except ValidationError as error:
        faults = [fault for fault in faults_of(error) if not fault.pointer.startswith(known)] + faults
    if faults:
        refuse("the assembly sequence cannot be used", faults)
    return document.operations


def read_operations(document: bytes, component_ids: Collection[str], limits: Limits) -> tuple[OperationEntry, ...]:
    """The checked operations of a JSON document."""
    return validate_operations(parse_json(document, "operations", limits.max_document_bytes), component_ids)


def operation_of(entry: OperationEntry) -> Operation:
    """The operation as the calculation knows it."""
    return Operation(
        id=entry.id,
        active=entry.active,
        passive=entry.passive,
        motion=entry.motion(),
        grasp=entry.grasp,
        force_N=entry.force,
        fit=entry.fit,
    )


def operations_document(operations: Iterable[Operation]) -> dict[str, Any]:
    """`{"operations": […]}` of operations of the calculation; `operation_of` is its inverse."""
    return {
        "operations": [
            {
                "id": operation.id,
                "active": list(operation.active),
                "passive": list(operation.passive),
                "pose_before": operation.motion[0].tolist(),
                "waypoints": operation.motion[1:-1].tolist(),
                "pose_after": operation.motion[-1].tolist(),
            }
            for operation in operations
        ]
    }
