"""The bill of materials in the form that the caller accepts."""

from collections.abc import Mapping
from typing import Any, Literal

from fastapi import Response
from fastapi.responses import JSONResponse

from gripwright.design.bom_forms import BY_GRIPPER, FLAT, LEVELS, bom_csv, bom_row, bom_views
from gripwright.http.errors import NotAcceptable
from gripwright.report.workbook import bom_workbook
from gripwright.store.media_types import media_type_of

JSON = "application/json"
CSV = "text/csv"
XLSX = "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet"
FORMS = (JSON, CSV, XLSX)

View = Literal["by-gripper", "flat", "levels"]

_NAMES: Mapping[View, str] = {"by-gripper": BY_GRIPPER, "flat": FLAT, "levels": LEVELS}


def bom_response(
    document: Mapping[str, Any],
    product: Mapping[str, Any],
    view: View,
    media_type: str,
    name: str,
    headers: Mapping[str, str],
) -> Response:
    """The bill of a design document in one of its forms, as one of FORMS."""
    columns, rows = bom_views(document, [bom_row(row) for row in document["bom"]])[_NAMES[view]]
    if media_type == JSON:
        return JSONResponse({"product": product, "items": rows}, headers=headers)
    ending = "csv" if media_type == CSV else "xlsx"
    content = bom_csv(rows, columns).encode() if media_type == CSV else bom_workbook({_NAMES[view]: rows})
    disposition = {"Content-Disposition": f'attachment; filename="{name}.{ending}"'}
    return Response(content, media_type=media_type_of(f"bom.{ending}"), headers={**headers, **disposition})


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
