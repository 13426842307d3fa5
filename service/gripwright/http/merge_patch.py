"""Merge patches (RFC 7396) as bodies of requests."""

from typing import Annotated, Any

from fastapi import Body, Depends, Request
from pydantic import BaseModel

from gripwright.http.errors import MERGE_PATCH_TYPES, UnsupportedMediaType


def patch_schema(model: type[BaseModel]) -> dict[str, Any]:
    """The request body of a patch, for the documentation, which has the model among its own."""
    schema = {"$ref": f"#/components/schemas/{model.__name__}"}
    return {"requestBody": {"required": True, "content": {name: {"schema": schema} for name in MERGE_PATCH_TYPES}}}


def is_merge_patch(request: Request) -> None:
    """UnsupportedMediaType where the body is of another type."""
    media_type = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if media_type not in MERGE_PATCH_TYPES:
        raise UnsupportedMediaType(f"a patch is {' or '.join(MERGE_PATCH_TYPES)}, this is {media_type or 'of no stated type'}")


def merge_patch(_: Annotated[None, Depends(is_merge_patch)], patch: Annotated[dict[str, Any], Body()]) -> dict[str, Any]:
    """The patch, an object."""
    return patch


MergePatch = Annotated[dict[str, Any], Depends(merge_patch)]
