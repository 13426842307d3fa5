"""Errors as callers see them (RFC 9457)."""

from http import HTTPStatus
from typing import Any

from pydantic import BaseModel, Field


class ProblemError(BaseModel):
    """One fault of the input."""

    pointer: str = Field(description="JSON pointer into the body, or a file name, or /query/… and /header/…")
    message: str


class Problem(BaseModel):
    """A problem document, `application/problem+json`."""

    type: str = Field(description="URN of the kind of problem, stable")
    title: str
    status: int
    detail: str
    errors: list[ProblemError] | None = Field(default=None, description="for input: every fault and its place")


def problems(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """Answers of a route that are problems, for its documentation."""
    content = {"application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}}
    return {status: {"description": HTTPStatus(status).phrase, "content": content} for status in statuses}
