"""Pages of a list: `cursor` and `limit` in, `next_cursor` and a `Link` header out."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Annotated, Any, Protocol, TypeVar

from fastapi import Depends, Query, Request, Response
from pydantic import AwareDatetime, BaseModel, BeforeValidator
from pydantic_core import PydanticCustomError

from gripwright.http.reading import Reading, content_tag
from gripwright.store.columns import utc_now
from gripwright.store.pages import Cursor

OVERLAP = timedelta(seconds=60)
"""Longer than any transaction is between the moment it writes down as that of the change, and its commit."""

_RFC_3339 = re.compile(r"\d{4}-\d\d-\d\d[Tt ]\d\d:\d\d:\d\d(\.\d{1,6})?([Zz]|[+-]\d\d:\d\d)")


def _moment(word: object) -> datetime:
    """A moment as RFC 3339 writes it, in UTC."""
    if not isinstance(word, str) or not _RFC_3339.fullmatch(word):
        raise PydanticCustomError("moment", "not a moment like 2026-01-31T12:00:00Z (RFC 3339; + is written %2B in a query)")
    try:
        return datetime.fromisoformat(word.upper()).astimezone(UTC)
    except (ValueError, OverflowError) as error:
        raise PydanticCustomError("moment", "no such moment: {reason}", {"reason": str(error)}) from None


class Changing(Protocol):
    """A row of a list that can be followed."""

    id: Any
    created_at: Any
    updated_at: Any


Row = TypeVar("Row")
ChangingRow = TypeVar("ChangingRow", bound=Changing)


@dataclass(frozen=True, slots=True)
class PageRequest:
    """Which page is asked for."""

    after: Cursor | None
    limit: int

    def cut(self, rows: Sequence[Row], cursor_of: Callable[[Row], Cursor]) -> tuple[Sequence[Row], str | None]:
        """The page, of rows fetched with `limit + 1`, and the cursor of the next one if there is one."""
        page = rows[: self.limit]
        return page, cursor_of(page[-1]).encode() if len(rows) > self.limit else None


async def page_request(
    cursor: Annotated[str | None, Query(description="`next_cursor` of the page before", max_length=500)] = None,
    limit: Annotated[int, Query(ge=1, le=200, description="items of a page")] = 50,
) -> PageRequest:
    """The page that the query asks for."""
    return PageRequest(after=None if cursor is None else Cursor.decode(cursor), limit=limit)


Page = Annotated[PageRequest, Depends(page_request)]


@dataclass(frozen=True, slots=True)
class ChangesRequest:
    """Which page of a list is asked for; with `updated_since`, of what has changed, in the order of the changes."""

    page: PageRequest
    updated_since: datetime | None
    asked_at: datetime

    def cut(self, rows: Sequence[ChangingRow]) -> tuple[Sequence[ChangingRow], str | None]:
        """The page, of rows fetched with `limit + 1`, and the cursor of the next one if there is one."""
        return self.page.cut(rows, self._cursor)

    @property
    def next_updated_since(self) -> datetime | None:
        """What to ask for the next time; known at the first page, for what changes while the others are read comes then."""
        return self.asked_at - OVERLAP if self.page.after is None else None

    def _cursor(self, row: Changing) -> Cursor:
        return Cursor(created_at=row.created_at if self.updated_since is None else row.updated_at, id=row.id)


def changes_request(
    page: Page,
    asked_at: Annotated[datetime, Depends(utc_now)],
    updated_since: Annotated[
        AwareDatetime | None,
        BeforeValidator(_moment),
        Query(description="only what has changed since then (RFC 3339), in the order of the changes"),
    ] = None,
) -> ChangesRequest:
    """The page that the query asks for."""
    return ChangesRequest(page, updated_since, asked_at)


Changes = Annotated[ChangesRequest, Depends(changes_request)]


def list_answer(request: Request, reading: Reading, page: BaseModel) -> Response:
    """A page as an answer, with its `Link`. When it was asked is no part of what its tag stands for."""
    still = page.model_copy(update={"next_updated_since": None})
    answer = reading.answer(page, tag=content_tag(still.model_dump_json().encode()))
    link_next(request, answer, getattr(page, "next_cursor", None))
    return answer


def link_next(request: Request, response: Response, next_cursor: str | None) -> None:
    """Name the next page in a `Link` header."""
    if next_cursor is not None:
        response.headers["Link"] = f'<{request.url.include_query_params(cursor=next_cursor)}>; rel="next"'
