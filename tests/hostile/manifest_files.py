"""Malformed manifests: (name, bytes of product.json). The part beside them is sound."""

import json

from upload_bodies import component, cuts, document

IDENTITY = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
_GOOD = json.dumps(document())


def bad_manifests():
    for name, value in _texts():
        yield name, value if isinstance(value, bytes) else value.encode()
    for name, value in (*_documents(), *_sequences()):
        yield name, json.dumps(value).encode()


def _texts():
    for length in cuts(_GOOD, 10):
        yield f"cut to {length} bytes", _GOOD[:length]
    yield "nested 100,000 deep", "[" * 100_000 + "]" * 100_000
    yield "objects 100,000 deep", '{"a":' * 100_000 + "1" + "}" * 100_000
    yield "a note nested 900 deep", _GOOD[:-1] + ', "note": ' + "[" * 900 + "]" * 900 + "}"
    for word in ("NaN", "Infinity", "-Infinity", "1e999", "9" * 5000, "0x10", "+1", "01", ".5", "1."):
        yield f"density is {word[:12]}", _GOOD.replace('"id"', f'"density": {word}, "id"')
    yield "a name twice", _GOOD.replace('"id"', '"id": "a", "id"')
    yield "half a surrogate pair", _GOOD.replace("H-1", "\\ud800")
    yield "half a surrogate pair as a name", _GOOD.replace('"id"', '"\\udfff": 1, "id"')
    yield "a NUL", _GOOD.replace("H-1", "\\u0000")
    for encoding in ("utf-16", "utf-16-be", "utf-32"):
        yield encoding, _GOOD.encode(encoding)
    yield "Latin-1", _GOOD.replace("H-1", "Größe").encode("latin-1")
    yield "overlong UTF-8", _GOOD.replace("H-1", "H?1").encode().replace(b"?", b"\xc0\xaf")
    yield "a surrogate in UTF-8", _GOOD.replace("H-1", "H?1").encode().replace(b"?", b"\xed\xa0\x80")
    yield "comments", "// product\n" + _GOOD
    yield "a comma too many", _GOOD[:-1] + ",}"
    yield "single quotes", _GOOD.replace('"', "'")
    yield "two documents", _GOOD + _GOOD
    yield "a control character", _GOOD.replace("H-1", "H\x01")
    for word in ("", "null", "true", "1", '""', "[]", "{}", "[1]", "\x00"):
        yield f"is {word!r}", word
    yield "YAML", "part_number: H-1\ncomponents: []\n"


def large_manifests():
    """Documents of up to 16 MB that are dear to check."""
    for name, text in _large_texts():
        yield name, text.encode()
    for name, value in _large_sequences():
        yield name, json.dumps(value).encode()


def _large_texts():
    yield "eight million numbers", '{"components": [' + "1," * 7_900_000 + "1]}"
    yield "eight million segments", _GOOD.replace('"id"', '"no_grasp": [{"segments": [' + '"",' * 5_000_000 + '""]}], "id"')
    yield "a million unknown fields", "{" + ",".join(f'"{k}":1' for k in range(1_000_000)) + "}"
    yield "a text of 15 MB", _GOOD.replace("H-1", "H" * 15_000_000)


def _documents():
    for field, values in {
        "part_number": [None, 1, "", " ", "a\nb", "x" * 501, [], "\u202e"[:0]],
        "components": [None, {}, [], "part", [None], [[]], [1]],
        "revision": [None, 1, "x" * 501],
        "environment": [{}, [1]],
        "operations": [{}, [1], "x"],
        "unknown": [1],
        "note": [1, "x" * 10_001],
    }.items():
        for value in values:
            yield f"{field} is {json.dumps(value)[:30]}", document(**{field: value})
    for field, values in {
        "id": [None, 1, "", ".", "..", "a/b", "a\\b", " a", "a\u0000", "x" * 201],
        "file": [None, 1, "", "part", "part.exe", "other.stl", "/part.stl", "../part.stl", "PART.STL", "part.stl\u0000"],
        "units": [None, "", "MM", "furlong", "mm ", 1, "µm", "millimetre"],
        "pose": [
            None, [], 1, "identity", [[1]], IDENTITY[:3], [[2, 0, 0, 0], *IDENTITY[1:]], [[-1, 0, 0, 0], *IDENTITY[1:]],
            [[1, 0, 0, 1e7], *IDENTITY[1:]], [[1, 0, 0, "0"], *IDENTITY[1:]], [*IDENTITY[:3], [0, 0, 1, 1]], [[0] * 4] * 4,
            [[1e308] * 4] * 4, [[1, 0, 0, 10**400], *IDENTITY[1:]], [[True, 0, 0, 0], *IDENTITY[1:]],
        ],
        "density": [0, -1, 1e30, "7850", True, [], 10**400],
        "friction": [0, -0.1, 6, None, "0.2"],
        "no_grasp": [1, [1], [{}], [{"box": {"min": [1, 1, 1], "max": [0, 0, 0]}}], [{"segments": [-1]}], [{"segments": [1.5]}]],
        "may_grasp": [[{"box": {"min": [0, 0], "max": [1, 1, 1]}}], [{"box": {}, "segments": [1]}]],
        "colour": ["red"],
    }.items():  # fmt: skip
        for value in values:
            yield f"component's {field} is {json.dumps(value)[:40]}", document({**component(), field: value})
    yield "one id twice", document(component(), component())
    yield "5,001 components", document(*(component(id=f"c{k}") for k in range(5001)))


def _operation(**fields):
    return {"id": "op", "active": ["part"], "passive": [], "pose_before": IDENTITY, "pose_after": IDENTITY, **fields}


def _sequences():
    turned = [[-1, 0, 0, 0], [0, -1, 0, 0], *IDENTITY[2:]]
    for name, fields in {
        "active of nobody": {"active": ["nobody"]},
        "active of none": {"active": []},
        "active twice": {"active": ["part", "part"]},
        "active and passive": {"passive": ["part"]},
        "no pose": {"pose_before": None},
        "half a turn": {"pose_before": turned},
        "a negative force": {"force": -1},
        "an infinite force": {"force": 1e300},
        "grasp of another": {"grasp": "other"},
        "an id of a list": {"id": ["op"]},
        "an unknown field": {"speed": 1},
        "an empty fit": {"fit": ""},
    }.items():
        yield f"operation: {name}", document(operations=[_operation(**fields)])
    yield "operation: moved twice", document(operations=[_operation(), _operation(id="op-2")])
    yield "operation: the id twice", document(component(), component(id="b"), operations=[_operation(), _operation(active=["b"])])
    yield "environment: unknown operation", document(environment=[{**component(id="e"), "operations": ["no"]}])


def _large_sequences():
    yield "operation: a million active", document(operations=[_operation(active=["part"] * 1_000_000)])
    yield "operation: a million who are not", document(operations=[_operation(active=[f"{k}" for k in range(900_000)])])
    yield "operation: 10,001 waypoints", document(operations=[_operation(waypoints=[IDENTITY] * 10_001)])
    many = [component(id=f"{k}", pose=0) for k in range(60_000)]
    chain = [{"active": [f"{k}"], "passive": [f"{k - 1}"]} for k in range(1, 60_000)]
    yield "60,000 components joined one by one", document(*many, operations=chain)
    whole = [{"active": [f"{k}" for k in range(1500)], "passive": []} for _ in range(800)]
    yield "800 operations that move 1,500 components twice", document(*many[:1501], operations=whole)
