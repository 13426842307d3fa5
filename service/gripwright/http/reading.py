"""What reads are answered with: a view or some of its fields, an entity tag, and nothing where the caller has it already."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, get_args

from fastapi import Depends, Query, Response, status
from pydantic import BaseModel

from gripwright.domain.errors import Fault, InvalidInput
from gripwright.http.preconditions import IfNoneMatch, is_known

NOT_MODIFIED: Mapping[int | str, dict[str, Any]] = {304: {"description": "Not modified"}}


@dataclass(frozen=True, slots=True)
class Reading:
    """What a caller wants to see, and what it has already."""

    if_none_match: str | None
    fields: str | None = None

    def answer(self, view: BaseModel, *, tag: str | None = None, headers: Mapping[str, str] | None = None) -> Response:
        """The view as JSON, or 304. Without a tag of its own it has the weak one of its content."""
        content = view.model_dump_json(include=self._included(view)).encode()
        tag = tag or content_tag(content)
        sent = {"ETag": tag, **(headers or {})}
        if is_known(self.if_none_match, tag):
            return Response(status_code=status.HTTP_304_NOT_MODIFIED, headers=sent)
        return Response(content, media_type="application/json", headers=sent)

    def _included(self, view: BaseModel) -> Any:
        """What pydantic is to include: of a list its items' fields are meant, what else it has is always there."""
        if self.fields is None:
            return None
        model = type(view)
        is_list = "items" in model.model_fields
        known = (get_args(model.model_fields["items"].annotation)[0] if is_list else model).model_fields
        names = {name.strip() for name in self.fields.split(",")}
        unknown = sorted(names - set(known))
        if unknown:
            message = f"no such field: {', '.join(map(repr, unknown))}; there are {', '.join(known)}"
            raise InvalidInput("fields names what there is not", faults=(Fault("/query/fields", message),))
        return {**dict.fromkeys(model.model_fields, True), "items": {"__all__": names}} if is_list else names


def content_tag(content: bytes) -> str:
    """A weak entity tag: equal contents mean the same, whoever wrote them."""
    return f'W/"{hashlib.sha256(content).hexdigest()[:32]}"'


def reading(if_none_match: IfNoneMatch = None) -> Reading:
    """A read of the whole."""
    return Reading(if_none_match)


def sparse_reading(
    if_none_match: IfNoneMatch = None,
    fields: Annotated[
        str | None,
        Query(max_length=1000, description="names, separated by commas; nothing else is sent. Of a list: of its items"),
    ] = None,
) -> Reading:
    """A read of all fields, or of some."""
    return Reading(if_none_match, fields)


Whole = Annotated[Reading, Depends(reading)]
Sparse = Annotated[Reading, Depends(sparse_reading)]
