"""Actuators as CSV: what a user imports, and what the seed was made from. Figures become totals, unknown ones stay unknown.

Columns: maker, model, type (parallel, centric, …) and fingers are required; stroke_mm, stroke_basis, opening_min_mm,
opening_max_mm, grip_force_N, force_basis, mass_kg or mass_g, finger_length_max_mm, finger_mass_max_kg, body_diameter_mm,
body_length_mm, price, confidence (A, B, C), source and note are optional, further columns are ignored.
- `stroke_basis` says what stroke_mm is: `total` (also the default) or `diameter`, or `per-jaw`, of which the opening
  changes by twice as much, however many jaws there are. Without the column the figure is the total. `none`: it has no jaws
  (vacuum, magnet); opening_max_mm and grip_force_N are then those of the largest face (cup, pole) that it serves.
- `force_basis` is per jaw where it begins with "per finger" or "per jaw", the total where it begins with "sum" or "total".
  Otherwise it is unknown, and the figure is taken as the total, the smaller reading.
- A text with unquoted commas is read as one cell where it can be told.
- Limits of the finger, the body and the basis of the stroke are also read from a note in the usual words:
  "max finger 165 mm, 0.5 kg each", "body 142x50x33 mm" (the last along the gripper's axis), "8 mm per jaw".
"""

import csv
import io
import math
import re
from collections.abc import Mapping

from gripwright.domain.errors import Fault
from gripwright.domain.gripper import NO_STROKE, Actuator

_REQUIRED = ("maker", "model", "type", "fingers")
_FIGURES = (
    "stroke_mm",
    "opening_min_mm",
    "opening_max_mm",
    "grip_force_N",
    "mass_kg",
    "mass_g",
    "finger_length_max_mm",
    "finger_mass_max_kg",
    "body_diameter_mm",
    "body_length_mm",
    "price",
)
_STROKE_FACTORS = {"total": 1.0, "diameter": 1.0, "per-jaw": 2.0, NO_STROKE: 0.0}
_CONFIDENCES = ("A", "B", "C")
_FINGERS_MAX = 8

_NUMBER = r"(\d+(?:\.\d+)?)"
_FINGER_NOTE = re.compile(rf"max finger(?: length)? {_NUMBER} mm(?:, {_NUMBER} kg each)?")
_BODY_NOTE = re.compile(rf"\b{_NUMBER}x{_NUMBER}x{_NUMBER} mm")
_DIFFERENCE_MM = 0.5  # of stroke and opening range, from which they conflict


def actuators_from_csv(text: str) -> tuple[tuple[Actuator, ...], tuple[Fault, ...]]:
    """The actuators of a CSV, and the faults of the rows that are not among them (pointer: /row/column, rows from 0)."""
    reader = csv.reader(io.StringIO(text.removeprefix("\ufeff"), newline=""))  # "\r" ends a line, too
    try:
        rows = [cells for cells in reader if cells]
    except csv.Error as error:
        return (), (Fault(pointer="", message=f"this is no CSV: line {reader.line_num}: {error}"),)
    columns = [column.strip() for column in rows[0]] if rows else []
    missing = [column for column in _REQUIRED if column not in columns]
    if missing:
        return (), tuple(Fault(pointer=f"/header/{column}", message=f"the column {column} is missing") for column in missing)
    actuators: dict[str, Actuator] = {}
    faults: list[Fault] = []
    for index, cells in enumerate(rows[1:]):
        cells = _joined(cells) if len(cells) > len(columns) else cells
        row = _Row(index, {column: cell.strip() for column, cell in zip(columns, cells, strict=False)})
        if len(cells) > len(columns):
            row.fault(columns[-1], f"the row has {len(cells)} cells for {len(columns)} columns")
        actuator = row.actuator()
        if actuator.name in actuators:
            row.fault("model", f"{actuator.name} stands in an earlier row too")
        faults.extend(row.faults)
        if not row.faults:
            actuators[actuator.name] = actuator
    return tuple(actuators.values()), tuple(faults)


def _joined(cells: list[str]) -> list[str]:
    """The cells of a row that has too many, with each cell that begins with a space joined to the one before.

    An unquoted comma within a text is followed by a space, one that separates cells is not.
    """
    joined = cells[:1]
    for cell in cells[1:]:
        if cell.startswith(" "):
            joined[-1] += "," + cell
        else:
            joined.append(cell)
    return joined


class _Row:
    """One row, and what is wrong with it."""

    def __init__(self, index: int, cells: Mapping[str, str]) -> None:
        self._index = index
        self._cells = cells
        self.faults: list[Fault] = []

    def fault(self, column: str, message: str) -> None:
        self.faults.append(Fault(pointer=f"/{self._index}/{column}", message=message))

    def actuator(self) -> Actuator:
        """The actuator; of use only where `faults` is empty."""
        figures = {column: self._figure(column) for column in _FIGURES}
        note = self._cells.get("note", "")
        fingers = self._fingers()
        stroke_mm, stroke_basis, conflict = self._stroke(figures, note)
        grip_force_N, force_basis = self._force(figures["grip_force_N"], fingers)
        finger = _FINGER_NOTE.search(note)
        body = [float(side) for side in match.groups()] if (match := _BODY_NOTE.search(note)) else None
        return Actuator(
            maker=self._text("maker"),
            model=self._text("model"),
            gripper_type=f"{self._text('type')}-{fingers}",
            stroke_mm=stroke_mm or 0.0,
            opening_max_mm=figures["opening_max_mm"],
            grip_force_N=grip_force_N,
            mass_kg=figures["mass_kg"] if figures["mass_g"] is None else figures["mass_g"] / 1000.0,
            finger_length_max_mm=figures["finger_length_max_mm"] or (float(finger.group(1)) if finger else None),
            finger_mass_max_kg=figures["finger_mass_max_kg"] or (float(finger.group(2)) if finger and finger.group(2) else None),
            body_diameter_mm=figures["body_diameter_mm"] or (round(math.hypot(body[0], body[1]), 1) if body else None),
            body_length_mm=figures["body_length_mm"] or (body[2] if body else None),
            price=figures["price"],
            stroke_basis=stroke_basis,
            force_basis=force_basis,
            confidence="C" if conflict else self._confidence(),
            source=self._cells.get("source", ""),
            note="; ".join(part for part in (note, conflict) if part),
        )

    def _text(self, column: str) -> str:
        if not self._cells.get(column):
            self.fault(column, f"{column} is empty")
        return self._cells.get(column, "")

    def _figure(self, column: str) -> float | None:
        cell = self._cells.get(column, "")
        if not cell:
            return None
        try:
            value = float(cell)
        except ValueError:
            value = math.nan
        if not math.isfinite(value) or value < 0.0:
            self.fault(column, f"{cell!r} is not a number of at least 0")
            return None
        return value

    def _fingers(self) -> int:
        cell = self._cells.get("fingers", "")
        if not (cell.isascii() and cell.isdigit() and 1 <= int(cell) <= _FINGERS_MAX):
            self.fault("fingers", f"{cell!r} is not a whole number from 1 to {_FINGERS_MAX}")
            return 0
        return int(cell)

    def _confidence(self) -> str:
        confidence = self._cells.get("confidence") or "B"
        if confidence not in _CONFIDENCES:
            self.fault("confidence", f"{confidence!r} is none of {', '.join(_CONFIDENCES)}")
        return confidence

    def _stroke(self, figures: Mapping[str, float | None], note: str) -> tuple[float | None, str, str]:
        """Total stroke, the basis that the maker states, and where the stroke conflicts with the opening range."""
        basis = self._cells.get("stroke_basis") or "total"
        if basis not in _STROKE_FACTORS:
            self.fault("stroke_basis", f"{basis!r} is none of {', '.join(_STROKE_FACTORS)}")
            basis = "total"
        stroke_mm, low_mm, high_mm = figures["stroke_mm"], figures["opening_min_mm"], figures["opening_max_mm"]
        if basis == NO_STROKE:
            return 0.0, basis, ""
        if stroke_mm is not None:
            stroke_mm *= _STROKE_FACTORS[basis]
        if not self._cells.get("stroke_basis"):
            basis = "per-jaw" if "mm per jaw" in note else "diameter" if "diameter" in note else basis
        if low_mm is None or high_mm is None:
            return stroke_mm, basis, ""
        if low_mm > high_mm:
            self.fault("opening_min_mm", f"{low_mm:g} mm is more than opening_max_mm {high_mm:g} mm")
        if stroke_mm is None:
            return high_mm - low_mm, basis, ""
        apart = abs(high_mm - low_mm - stroke_mm) > _DIFFERENCE_MM
        conflict = f"CONFLICT: stroke {stroke_mm:g} mm, opening {low_mm:g} to {high_mm:g} mm" if apart else ""
        return stroke_mm, basis, conflict

    def _force(self, stated_N: float | None, fingers: int) -> tuple[float | None, str]:
        """Total grip force and the basis that the maker states."""
        stated_basis = self._cells.get("force_basis", "").lower()
        if stated_basis.startswith(("per finger", "per jaw", "per-jaw")):
            return (None if stated_N is None else stated_N * fingers), "per-jaw"
        return stated_N, "total" if stated_basis.startswith(("sum", "total")) else "unknown"
