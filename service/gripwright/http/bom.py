"""The bill of materials in the form that the caller accepts."""

import csv
import io

from fastapi import Response
from fastapi.responses import JSONResponse
from openpyxl import Workbook
from openpyxl.cell.cell import ILLEGAL_CHARACTERS_RE

from gripwright.http.errors import NotAcceptable

JSON = "application/json"
CSV = "text/csv"
XLSX = "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet"


def bom_response(table: bytes, accept: str, name: str) -> Response:
    """The rows of bom.csv as JSON, CSV or XLSX, whichever of them `accept` likes best."""
    media_type = preferred(accept, (JSON, CSV, XLSX))
    if media_type == CSV:
        headers = {"Content-Disposition": f'inline; filename="{name}.csv"', "Vary": "Accept"}
        return Response(table, media_type="text/csv; charset=utf-8", headers=headers)
    rows = list(csv.DictReader(io.StringIO(table.decode())))
    if media_type == JSON:
        items = [{name: typed(value) for name, value in row.items()} for row in rows]
        return JSONResponse({"items": items}, headers={"Vary": "Accept"})
    headers = {"Content-Disposition": f'attachment; filename="{name}.xlsx"', "Vary": "Accept"}
    return Response(_workbook(rows), media_type=XLSX, headers=headers)


def preferred(accept: str, offered: tuple[str, ...]) -> str:
    """The media type on offer with the highest quality (RFC 9110), the first of equals; NotAcceptable where there is none."""
    best, best_quality = "", 0.0
    for media_type in offered:
        quality = _quality(accept, media_type)
        if quality > best_quality:
            best, best_quality = media_type, quality
    if not best:
        raise NotAcceptable(f"Accept allows none of {', '.join(offered)}: {accept}")
    return best


def _quality(accept: str, media_type: str) -> float:
    """What the most specific range that covers a media type says of it."""
    found, specificity = 0.0, -1
    for part in accept.split(","):
        pattern, *parameters = (word.strip().lower() for word in part.split(";"))
        covers = ("*/*", media_type.partition("/")[0] + "/*", media_type)
        if pattern in covers and covers.index(pattern) > specificity:
            specificity = covers.index(pattern)
            found = next((_number(p[2:]) for p in parameters if p.startswith("q=")), 1.0)
    return found


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0


def typed(value: str) -> float | int | str | None:
    """A cell as JSON value: whole numbers, numbers, texts, and null where it is empty."""
    if not value:
        return None
    for kind in (int, float):
        try:
            number = kind(value)
        except ValueError:
            continue
        if str(number) == value:  # not "007", "1e5", "nan": those are names
            return number
    return value


def _workbook(rows: list[dict[str, str]]) -> bytes:
    book = Workbook()
    sheet = book.create_sheet("BOM", 0)
    if rows:
        sheet.append(list(rows[0]))
    for row in rows:
        sheet.append([_cell(typed(value)) for value in row.values()])
    target = io.BytesIO()
    book.save(target)
    return target.getvalue()


def _cell(value: float | int | str | None) -> float | int | str | None:
    """A cell that no spreadsheet takes for a formula."""
    if isinstance(value, str):
        value = ILLEGAL_CHARACTERS_RE.sub("", value)
        return f"'{value}" if value[:1] in "=+-@" else value
    return value
