"""The bill of materials as a workbook (XLSX). The same rows give the same bytes: no times."""

import io
import re
import zipfile
from collections.abc import Mapping, Sequence
from typing import Any

from openpyxl import Workbook
from openpyxl.cell.cell import ILLEGAL_CHARACTERS_RE

from gripwright.design.bom_forms import plain

_WIDEST = 60  # characters of a column
_ZIP_EPOCH = (1980, 1, 1, 0, 0, 0)
_TIMES = re.compile(rb"(<dcterms:(created|modified)[^>]*>)[^<]*")  # in docProps/core.xml
_EPOCH = rb"\g<1>1980-01-01T00:00:00Z"


def bom_workbook(sheets: Mapping[str, Sequence[Mapping[str, Any]]]) -> bytes:
    """The rows below a header, on a sheet for each name; the header stays in sight, columns are as wide as their text."""
    book = Workbook()
    book.remove(book.worksheets[0])
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        if rows:
            sheet.append(list(rows[0]))
        for row in rows:
            sheet.append([_cell(value) for value in row.values()])
        sheet.freeze_panes = "A2"
        for column in sheet.columns:
            width = max(len(str(cell.value)) for cell in column if cell.value is not None)
            sheet.column_dimensions[column[0].column_letter].width = min(width + 2, _WIDEST)
    target = io.BytesIO()
    book.save(target)
    return _timeless(target.getvalue())


def _timeless(workbook: bytes) -> bytes:
    """The same archive without the time at which it was made."""
    target = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(workbook)) as made, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in made.namelist():
            entry = zipfile.ZipInfo(name, date_time=_ZIP_EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            content = made.read(name)
            archive.writestr(entry, _TIMES.sub(_EPOCH, content) if name == "docProps/core.xml" else content)
    return target.getvalue()


def _cell(value: Any) -> float | int | str | None:
    if isinstance(value, list):
        value = "; ".join(map(str, value))
    if isinstance(value, str):
        return plain(ILLEGAL_CHARACTERS_RE.sub("", value))
    return value if value is None or isinstance(value, int | float) else str(value)
