"""The bill of materials in the forms in which it is read: by gripper, flat, multi-level; as rows of JSON values and as CSV."""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from gripwright.design.stages.bom import ASSEMBLE, COLUMNS, MAKE, OWNED, BomRow, part_number

BY_GRIPPER, FLAT, LEVELS = "bom", "bom-flat", "bom-levels"
LEVEL_COLUMNS = ("level", "parent", *COLUMNS)

_ASSEMBLY_FILES = ("gripper.glb", "gripper.urdf", "tool.json")
_SEPARATOR = "; "


def bom_views(design: Mapping[str, Any], rows: Sequence[BomRow]) -> dict[str, tuple[tuple[str, ...], list[dict[str, Any]]]]:
    """The bill in its forms, by name: by gripper, flat (what to order in all) and multi-level; columns and rows of each.

    `design` is the document of which they are the rows; operations stand in the order of its sequence.
    """
    sequence = [operation["id"] for operation in design["operations"]]
    forms = {
        BY_GRIPPER: (COLUMNS, [row.to_dict() for row in rows]),
        FLAT: (COLUMNS, [row.to_dict() for row in bom_flat(rows)]),
        LEVELS: (LEVEL_COLUMNS, bom_levels(design["product"], rows)),
    }
    for _, form in forms.values():
        for row in form:
            row["operations"].sort(key=sequence.index)
    return forms


def bom_csv(rows: Sequence[Mapping[str, Any]], columns: Sequence[str] = COLUMNS) -> str:
    """Rows of JSON values as CSV with a header; several values in a cell are separated by a semicolon."""
    target = io.StringIO()
    writer = csv.writer(target, lineterminator="\n")
    writer.writerow(columns)
    for row in rows:
        writer.writerow(_cell(row[column]) for column in columns)
    return target.getvalue()


def bom_row(document: Mapping[str, Any]) -> BomRow:
    """A row from its JSON values."""
    values: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in document.items()}
    return BomRow(**values)


def bom_levels(product: Mapping[str, str], rows: Sequence[BomRow]) -> list[dict[str, Any]]:
    """The same as a multi-level bill: the set of grippers (level 0), each gripper (1) and its items (2), the parent of each.

    `product` has the part number and the revision for which the set is made.
    """
    assemblies: dict[str, list[BomRow]] = {}
    for row in rows:
        assemblies.setdefault(row.gripper, []).append(row)
    grippers = {gripper: own[0] if own[0].make_or_buy == OWNED else _assembly(own) for gripper, own in assemblies.items()}
    product_name = f"{product['part_number']} revision {product['revision']}"
    the_set = _assembled("gripper set", "S", list(grippers.values()), f"gripper set for {product_name}", "")
    levels = [{"level": 0, "parent": None, **the_set.to_dict()}]
    for gripper, own in assemblies.items():
        levels.append({"level": 1, "parent": the_set.part_number, **grippers[gripper].to_dict()})
        if own[0].make_or_buy != OWNED:
            levels.extend({"level": 2, "parent": grippers[gripper].part_number, **row.to_dict()} for row in own)
    return levels


def _assembly(own: Sequence[BomRow]) -> BomRow:
    """A gripper put together from its items."""
    gripper = own[0].gripper
    assembled = _assembled("gripper", "G", own, f"gripper {gripper} on {own[0].maker} {own[0].model}", gripper)
    made = any(row.make_or_buy == MAKE for row in own)
    return replace(assembled, files=tuple(f"grippers/{gripper}/{name}" for name in _ASSEMBLY_FILES) if made else ())


def _assembled(item: str, kind: str, parts: Sequence[BomRow], description: str, gripper: str) -> BomRow:
    """An assembly of parts; its number depends on them, its mass is known where those of all are."""
    masses = [None if row.mass_kg is None else row.quantity * row.mass_kg for row in parts]
    return BomRow(
        gripper=gripper,
        item=item,
        make_or_buy=ASSEMBLE,
        maker="",
        model="",
        part_number=part_number(kind, "\n".join(f"{row.quantity} {row.maker} {row.part_number}" for row in parts)),
        quantity=1,
        description=description,
        mass_kg=None if None in masses else round(sum(mass for mass in masses if mass is not None), 6),
        operations=tuple(dict.fromkeys(operation for row in parts for operation in row.operations)),
    )


def bom_flat(rows: Sequence[BomRow]) -> list[BomRow]:
    """What to buy and to make in all: rows of the same part joined, whichever gripper they belong to."""
    joined: dict[tuple[str, str, str], BomRow] = {}
    for row in rows:
        key = (row.make_or_buy, row.maker, row.part_number)
        if key not in joined:
            joined[key] = row
            continue
        earlier = joined[key]
        joined[key] = replace(
            earlier,
            gripper=f"{earlier.gripper}{_SEPARATOR}{row.gripper}",
            quantity=earlier.quantity + row.quantity,
            operations=tuple(dict.fromkeys((*earlier.operations, *row.operations))),
            files=tuple(dict.fromkeys((*earlier.files, *row.files))),
        )
    return list(joined.values())


def plain(text: str) -> str:
    """The text as no spreadsheet takes it for a formula."""
    return f"'{text}" if text.startswith(("=", "+", "-", "@")) else text


def _cell(value: Any) -> Any:
    if isinstance(value, list):
        value = _SEPARATOR.join(value)
    return "" if value is None else plain(value) if isinstance(value, str) else value
