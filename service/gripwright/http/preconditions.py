"""Entity tags: `If-Match` for changes, `If-None-Match` for reads."""

import re
from typing import Annotated

from fastapi import Header

from gripwright.http.errors import PreconditionFailed, PreconditionRequired

IfMatch = Annotated[str | None, Header(alias="If-Match", description="the ETag that the change is meant for")]
IfNoneMatch = Annotated[str | None, Header(alias="If-None-Match", description="an ETag that the caller has already")]
IfRange = Annotated[str | None, Header(alias="If-Range", description="the ETag that a range is meant for; else all is sent")]
Range = Annotated[str | None, Header(alias="Range", description="`bytes=0-999`: a part of the file", examples=["bytes=0-999"])]

ABSENT = ""
"""The tag of what is not there: no `If-Match` matches it, not even `*`."""

_TAG = re.compile(r'(?:W/)?("[^"]*")')


def version_tag(version: int) -> str:
    """The entity tag of a row that counts its changes."""
    return f'"{version}"'


def require_match(if_match: str | None, tag: str) -> None:
    """PreconditionRequired where the caller names no version, PreconditionFailed where it names another."""
    if if_match is None:
        raise PreconditionRequired(f"send If-Match with the ETag of what you mean, at present {tag}")
    check_match(if_match, tag)


def check_match(if_match: str | None, tag: str) -> None:
    """PreconditionFailed where the caller names another version than the present one."""
    if if_match is None:
        return
    if tag == ABSENT or not _names(if_match, tag, weak=False):
        raise PreconditionFailed(f"If-Match says {if_match}, the present version is {tag or 'none'}")


def is_known(if_none_match: str | None, tag: str) -> bool:
    """Whether the caller has this version already: the answer is 304."""
    return if_none_match is not None and _names(if_none_match, tag, weak=True)


def _names(header: str, tag: str, *, weak: bool) -> bool:
    """Whether a list of tags, or `*`, names this one; If-Match asks for strong comparison."""
    if header.strip() == "*":
        return True
    bare = tag.removeprefix("W/")
    return any(match[1] == bare and (weak or not match[0].startswith("W/")) for match in _TAG.finditer(header))
