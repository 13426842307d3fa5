"""The OpenAPI document: the framework's, with errors as the problems that are sent, and the scope that each route needs."""

from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi

from gripwright.http.gate import required_scope
from gripwright.http.idempotency import HEADER, KEY_LENGTH, KEY_PATTERN, REPLAYED
from gripwright.http.schemas.problem import Problem, problems
from gripwright.http.schemas.products import ComponentPatch

_REF = "#/components/schemas/{model}"
_BEARER = {
    "type": "http",
    "scheme": "bearer",
    "description": "An API key, or a token of the issuer. Not asked for where the service listens on loopback alone.",
}
_IDEMPOTENCY_KEY = {
    "name": HEADER,
    "in": "header",
    "required": False,
    "description": (
        "A name of this request that its caller makes up. The same request again is answered as the first time, with "
        f"`{REPLAYED}: true`, and done once; 409 while the first is being answered, 422 where it was another request"
    ),
    "schema": {"type": "string", "minLength": 1, "maxLength": KEY_LENGTH, "pattern": KEY_PATTERN},
}
_REPLACED = ("HTTPValidationError", "ValidationError")


def describe_problems(app: FastAPI) -> None:
    """Let the app publish a document in which errors are problems."""

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is None:
            app.openapi_schema = _document(app)
        return app.openapi_schema

    app.openapi = openapi  # type: ignore[method-assign]  # as the framework's documentation says


def _document(app: FastAPI) -> dict[str, Any]:
    document = get_openapi(title=app.title, version=app.version, description=app.description, routes=app.routes)
    schemas: dict[str, Any] = document["components"]["schemas"]
    for name in _REPLACED:
        schemas.pop(name, None)
    for model in (Problem, ComponentPatch):
        schema = model.model_json_schema(ref_template=_REF)
        schemas.update(schema.pop("$defs"))
        schemas[model.__name__] = schema
    document["components"]["securitySchemes"] = {"bearer": _BEARER}
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            scope = required_scope(method.upper(), path)
            operation["security"] = [] if scope is None else [{"bearer": [scope.value]}]
            if scope is not None:
                operation["responses"] |= {str(status): answer for status, answer in problems(401, 403, 429).items()}
            if "422" in operation["responses"]:
                operation["responses"]["422"] = problems(422)[422]
            if method == "post":
                operation.setdefault("parameters", []).append(_IDEMPOTENCY_KEY)
                operation["responses"] |= {str(status): answer for status, answer in problems(409, 422).items()}
            if "requestBody" in operation:
                operation["responses"] |= {str(status): answer for status, answer in problems(400, 413, 415).items()}
    return document
