"""Pages of a list: `cursor` and `limit` in, `next_cursor` and a `Link` header out."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, TypeVar

from fastapi import Depends, Query, Request, Response

from gripwright.store.pages import Cursor

Row = TypeVar("Row")


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
    limit: Annotated[int, Query(ge=1, le=200)] = 50,
) -> PageRequest:
    """The page that the query asks for."""
    return PageRequest(after=None if cursor is None else Cursor.decode(cursor), limit=limit)


Page = Annotated[PageRequest, Depends(page_request)]


def link_next(request: Request, response: Response, next_cursor: str | None) -> None:
    """Name the next page in a `Link` header."""
    if next_cursor is not None:
        response.headers["Link"] = f'<{request.url.include_query_params(cursor=next_cursor)}>; rel="next"'
