"""The bill of materials in the form that the caller accepts."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fastapi import Response
from fastapi.responses import JSONResponse

from gripwright.http.errors import NotAcceptable
from gripwright.report.workbook import bom_workbook
from gripwright.store.media_types import media_type_of

JSON = "application/json"
CSV = "text/csv"
XLSX = "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet"


def bom_response(rows: Sequence[Mapping[str, Any]], table: Path, accept: str, name: str) -> Response:
    """The rows as JSON or XLSX, or the table bom.csv itself, whichever `accept` likes best."""
    media_type = preferred(accept, (JSON, CSV, XLSX))
    if media_type == JSON:
        return JSONResponse({"items": list(rows)}, headers={"Vary": "Accept"})
    ending = "csv" if media_type == CSV else "xlsx"
    headers = {"Content-Disposition": f'attachment; filename="{name}.{ending}"', "Vary": "Accept"}
    content = table.read_bytes() if media_type == CSV else bom_workbook(rows)
    return Response(content, media_type=media_type_of(f"bom.{ending}"), headers=headers)


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
