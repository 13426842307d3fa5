import re

import pytest
from jsonschema import Draft202012Validator, FormatChecker

from gripwright.cli.openapi import openapi_document

DOCUMENT = openapi_document()
OPERATIONS = {
    operation["operationId"]: (method, path, operation)
    for path, operations in DOCUMENT["paths"].items()
    for method, operation in operations.items()
}
JSON = ("application/json", "application/merge-patch+json")


def bodies(operation):
    """Every JSON body of an operation: what it is, and its content."""
    for media_type, content in operation.get("requestBody", {}).get("content", {}).items():
        if media_type in JSON:
            yield f"request {media_type}", content
    for status, answer in operation["responses"].items():
        for media_type, content in answer.get("content", {}).items():
            if media_type in JSON and status < "400":
                yield f"response {status}", content


def validator(schema):
    return Draft202012Validator({**schema, "components": DOCUMENT["components"]}, format_checker=FormatChecker())


def test_the_document_is_of_openapi_3_1_and_names_each_operation_once():
    count = sum(len(operations) for operations in DOCUMENT["paths"].values())

    assert DOCUMENT["openapi"].startswith("3.1")
    assert len(OPERATIONS) == count


@pytest.mark.parametrize("name", sorted(OPERATIONS))
def test_every_operation_is_described_and_says_how_it_refuses(name):
    _, path, operation = OPERATIONS[name]

    assert re.fullmatch(r"[a-z]+(_[a-z]+)*", name)
    assert operation["summary"]
    assert operation["description"]
    assert [parameter["name"] for parameter in operation.get("parameters", []) if not parameter.get("description")] == []
    assert set(re.findall(r"{(\w+)", path)) == {p["name"] for p in operation.get("parameters", []) if p["in"] == "path"}
    refusals = {status: answer for status, answer in operation["responses"].items() if status >= "400"}
    assert "400" in refusals
    for answer in refusals.values():
        assert list(answer["content"]) == ["application/problem+json"]


@pytest.mark.parametrize("name", sorted(OPERATIONS))
def test_every_json_body_has_an_example_that_is_what_its_schema_says(name):
    for body, content in bodies(OPERATIONS[name][2]):
        assert "example" in content, body
        errors = [error.message for error in validator(content.get("schema", {})).iter_errors(content["example"])]
        assert errors == [], body


def test_examples_of_schemas_are_what_they_say():
    for name, schema in DOCUMENT["components"]["schemas"].items():
        for example in schema.get("examples", []):
            assert [error.message for error in validator(schema).iter_errors(example)] == [], name
