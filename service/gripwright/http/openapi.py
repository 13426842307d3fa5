"""The OpenAPI document: the framework's, with errors as the problems that are sent, and the scope that each route needs."""

from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi

from gripwright.http.examples import PROBLEM, REQUESTS, RESPONSES
from gripwright.http.gate import required_scope
from gripwright.http.idempotency import HEADER, KEY_LENGTH, KEY_PATTERN, REPLAYED
from gripwright.http.schemas.problem import Problem, problems
from gripwright.http.schemas.products import ComponentPatch, ProductPatch

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
_PARAMETERS = {
    "product_id": "id of a product",
    "component_id": "id of a component, as in product.json",
    "design_id": "id of a design",
    "job_id": "id of a job, which is that of its design",
    "webhook_id": "id of a webhook",
    "delivery_id": "id of a message, its `webhook-id`",
    "path": "of a file in the design folder: `grippers/G1/finger.step`",
    "kind": "of a plug-in: `segmenter`",
    "name": "of a plug-in: `sdf`",
    "maker": "of an actuator",
    "part_number": "only that part number",
    "revision": "only that revision",
    "status": "only those",
    "actor": "only what that one did: `key:ID`",
    "resource_id": "only what was done to that one",
}
"""Descriptions of parameters that have none of their own."""

_NO_NUL = "^[^\\u0000]*$"
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
    for model in (Problem, ComponentPatch, ProductPatch):
        schema = model.model_json_schema(ref_template=_REF)
        schemas.update(schema.pop("$defs", {}))
        schemas[model.__name__] = schema
    schemas["Problem"]["examples"] = [PROBLEM]
    document["components"]["securitySchemes"] = {"bearer": _BEARER}
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            scope = required_scope(method.upper(), path)
            _describe(operation)
            _allow_sparse(operation, schemas)
            operation["security"] = [] if scope is None else [{"bearer": [scope.value]}]
            refusals = (400,) if scope is None else (400, 401, 403, 429, 503)
            operation["responses"] |= {str(status): answer for status, answer in problems(*refusals).items()}
            if "422" in operation["responses"]:
                operation["responses"]["422"] = problems(422)[422]
            if method == "post":
                operation.setdefault("parameters", []).append(_IDEMPOTENCY_KEY)
                operation["responses"] |= {str(status): answer for status, answer in problems(409, 422).items()}
            if "requestBody" in operation:
                operation["responses"] |= {str(status): answer for status, answer in problems(413, 415).items()}
    return document


def _describe(operation: dict[str, Any]) -> None:
    """What parameters mean, and an example of each JSON body."""
    for parameter in operation.get("parameters", []):
        if not parameter.get("description"):
            parameter["description"] = _PARAMETERS[parameter["name"]]
        if parameter["in"] != "header":
            _exclude_nul(parameter["schema"])
    name = operation["operationId"]
    _exemplify(operation.get("requestBody", {}), REQUESTS.get(name))
    for status, answer in operation["responses"].items():
        _exemplify(answer, RESPONSES.get(name, {}).get(status))


def _exclude_nul(schema: dict[str, Any]) -> None:
    """Say of free text in an address that it holds no NUL character."""
    for form in (schema, *schema.get("anyOf", ())):
        if form.get("type") == "string" and not {"enum", "const", "format", "pattern"} & set(form):
            form["pattern"] = _NO_NUL


def _allow_sparse(operation: dict[str, Any], schemas: dict[str, Any]) -> None:
    """Say that with `fields` an answer, or each item of a list, has some of its members alone."""
    fields = [parameter["schema"] for parameter in operation.get("parameters", []) if parameter["name"] == "fields"]
    if not fields:
        return
    content = operation["responses"]["200"]["content"]["application/json"]
    name = _model(content["schema"])
    page = schemas[name]["properties"]
    item = _model(page["items"]["items"]) if "items" in page else name
    names = list(schemas[item]["properties"])
    one = f"({'|'.join(names)})"
    fields[0] |= {"pattern": f"^{one}(,{one})*$", "examples": [names[0], ",".join(names[:2])]}
    if item != name:
        items = {**page["items"], "items": {"$ref": _add_sparse(item, schemas)}}
        sparse = _REF.format(model=f"Sparse{name}")
        schemas[f"Sparse{name}"] = {**schemas[name], "title": f"Sparse{name}", "properties": {**page, "items": items}}
    else:
        sparse = _add_sparse(name, schemas)
    content["schema"] = {"anyOf": [content["schema"], {"$ref": sparse}]}


def _add_sparse(name: str, schemas: dict[str, Any]) -> str:
    """The reference to a model like the named one of which no member is required."""
    shared = {key: value for key, value in schemas[name].items() if key != "required"}
    described = f"{name} with some of its members: those that `fields` names"
    schemas[f"Sparse{name}"] = {**shared, "title": f"Sparse{name}", "description": described, "minProperties": 1}
    return _REF.format(model=f"Sparse{name}")


def _model(schema: dict[str, Any]) -> str:
    return str(schema["$ref"]).rpartition("/")[2]


def _exemplify(body: dict[str, Any], example: Any) -> None:
    for media_type, content in body.get("content", {}).items():
        if media_type in ("application/json", "application/merge-patch+json") and example is not None:
            content["example"] = example
