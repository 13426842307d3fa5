"""Malformed STEP files: (name, bytes), and an assembly of more parts than any product has."""

import re
from functools import cache

from upload_bodies import cuts

from gripwright.cad.export import step_bytes
from gripwright.geometry.brep import box, cut, cylinder_z, write_brep

_HEAD = (
    "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('a','2020-01-01T00:00:00',(''),(''),'','','');\n"
    "FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\nDATA;\n"
)
_TAIL = "ENDSEC;\nEND-ISO-10303-21;\n"


@cache
def block():
    """A sound file: a block with a bore."""
    return step_bytes(write_brep(cut(box((0, 0, 0), (40, 30, 20)), [cylinder_z(20, 15, 8, -1, 21)])), name="b", part_number="B")


def bad_step_files():
    data = block()
    for length in cuts(data, 16, last=len(data) - 30):
        yield f"cut to {length} bytes", data[:length]
    text = data.decode()
    for name, changed in (*_changes(text), *_invented()):
        yield name, changed.encode() if isinstance(changed, str) else changed


def _changes(text):
    entity = re.compile(r"#(\d+) = ADVANCED_FACE\(")
    number = entity.search(text)[1]
    yield "no end", text.replace("END-ISO-10303-21;", "")
    yield "no end of the data", text.replace("ENDSEC;\nEND-ISO", "END-ISO")
    yield "no data", text[: text.index("DATA;")] + _TAIL
    yield "no header", text[: text.index("HEADER;")] + text[text.index("DATA;") :]
    yield (
        "every face refers to itself",
        re.sub(r"(#\d+) = ADVANCED_FACE\('',\([^)]*\),#\d+", r"\1 = ADVANCED_FACE('',(\1),\1", text),
    )
    yield (
        "faces of one bound refer to themselves, the others are sound",
        re.sub(r"(#\d+) = ADVANCED_FACE\('',\((#\d+)\),#\d+", r"\1 = ADVANCED_FACE('',(\1),\1", text),
    )
    yield "one edge is not there", re.sub(r"#\d+ = EDGE_CURVE\([^;]*;", "", text, count=1)
    yield "the bore has a radius below 0", re.sub(r"(CYLINDRICAL_SURFACE\('',#\d+),8\.", r"\1,-8.", text)
    yield "a shell of itself", re.sub(r"(#\d+) = CLOSED_SHELL\('',\([^)]*\)", r"\1 = CLOSED_SHELL('',(\1)", text)
    yield "a solid of itself", re.sub(r"(#\d+) = MANIFOLD_SOLID_BREP\('',#\d+", r"\1 = MANIFOLD_SOLID_BREP('',\1", text)
    yield "loops of themselves", re.sub(r"(#\d+) = EDGE_LOOP\('',\([^)]*\)", r"\1 = EDGE_LOOP('',(\1)", text)
    yield "faces that are not there", re.sub(r"ADVANCED_FACE\('',\([^)]*\),#\d+", "ADVANCED_FACE('',(#999999),#999998", text)
    yield "points of letters", re.sub(r"CARTESIAN_POINT\('',\([^)]*\)", "CARTESIAN_POINT('',(a,b,c)", text)
    yield "points of nothing", re.sub(r"CARTESIAN_POINT\('',\([^)]*\)", "CARTESIAN_POINT('',()", text)
    yield "points of 1e300", re.sub(r"CARTESIAN_POINT\('',\([^)]*\)", "CARTESIAN_POINT('',(1.E300,-1.E300,1.E300)", text)
    yield "points all the same", re.sub(r"CARTESIAN_POINT\('',\([^)]*\)", "CARTESIAN_POINT('',(0.,0.,0.)", text)
    yield "directions of length 0", re.sub(r"DIRECTION\('',\([^)]*\)", "DIRECTION('',(0.,0.,0.)", text)
    yield "no faces", re.sub(r"CLOSED_SHELL\('',\([^)]*\)", "CLOSED_SHELL('',()", text)
    yield (
        "a representation of itself",
        re.sub(
            r"(#\d+) = ADVANCED_BREP_SHAPE_REPRESENTATION\('',\([^)]*\)", r"\1 = ADVANCED_BREP_SHAPE_REPRESENTATION('',(\1)", text
        ),
    )
    yield "no solids", text.replace("MANIFOLD_SOLID_BREP", "MANIFOLD_NOTHING")
    yield "the number of an entity is 20 digits", text.replace(f"#{number} ", "#99999999999999999999 ")
    yield (
        "bytes of noise in the data",
        text.replace("DATA;\n", "DATA;\n" + "".join(chr(33 + k * 7 % 90) for k in range(5000)) + "\n"),
    )
    yield (
        "units that are not",
        re.sub(r"SI_UNIT\(\.MILLI\.,\.METRE\.\)", "SI_UNIT(.MILLI.,.GRAM.)", text).replace("LENGTH_UNIT", "MASS_UNIT"),
    )
    yield "UTF-16", text.encode("utf-16")
    yield "blocks of 1e-9 mm", re.sub(r"(-?\d+\.\d*)(?=[,)])", r"\1E-11", text)


def _invented():
    yield "empty", ""
    yield "the first line", "ISO-10303-21;\n"
    yield "no entity", _HEAD + _TAIL
    yield "noise", _HEAD + "".join(chr(33 + k * 31 % 90) for k in range(20_000)) + _TAIL
    for depth in (1000, 50_000, 2_000_000):
        yield f"parentheses {depth} deep", _HEAD + "#1 = PRODUCT(" + "(" * depth + ")" * depth + ");\n" + _TAIL
    yield "a string without end", _HEAD + "#1 = PRODUCT('" + "a" * 1_000_000
    yield "a comment without end", _HEAD + "/* " + "a" * 1_000_000
    yield "an entity of itself", _HEAD + "#1 = PRODUCT_DEFINITION('',$,#1,#1);\n" + _TAIL
    ring = "".join(f"#{k} = PRODUCT_DEFINITION('',$,#{k % 5000 + 1},#{(k + 1) % 5000 + 1});\n" for k in range(1, 5001))
    yield "a ring of 5,000 entities", _HEAD + ring + _TAIL
    for degree in (30, 100_000, 2_147_483_647, -3):
        yield f"a B-spline of degree {degree}", _HEAD + _spline(degree) + _TAIL
    yield "200,000 products", _HEAD + "".join(f"#{k} = PRODUCT('{k}','','',());\n" for k in range(1, 200_000)) + _TAIL
    yield "an entity number twice", _HEAD + "#1 = PRODUCT('a','','',());\n" * 2 + _TAIL
    yield "a schema that is not", (_HEAD + _TAIL).replace("AUTOMOTIVE_DESIGN", "KITCHEN_DESIGN")
    yield "old Part 21", "STEP;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nENDSTEP;\n"
    yield "IGES", " " * 72 + "S      1\n1H,,1H;,4Ha.ig" + " " * 57 + "G      1\n"


def _spline(degree):
    points = "".join(f"#{k} = CARTESIAN_POINT('',({k}.,{k % 3}.,0.));\n" for k in range(1, 9))
    corners = ",".join(f"#{k}" for k in range(1, 9))
    return (
        f"{points}#20 = B_SPLINE_CURVE_WITH_KNOTS('',{degree},({corners}),.UNSPECIFIED.,.F.,.F.,"
        f"({degree + 1},{degree + 1}),(0.,1.),.UNSPECIFIED.);\n#21 = GEOMETRIC_CURVE_SET('',(#20));\n"
        "#22 = GEOMETRICALLY_BOUNDED_WIREFRAME_SHAPE_REPRESENTATION('',(#21),#30);\n"
        "#30 = ( GEOMETRIC_REPRESENTATION_CONTEXT(3) GLOBAL_UNIT_ASSIGNED_CONTEXT((#31)) REPRESENTATION_CONTEXT('','') );\n"
        "#31 = ( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) );\n"
    )
