from dataclasses import replace

import numpy as np
import pytest

from gripwright.design.memory import Memory
from mesh_factory import box_mesh


class Shelf(dict):
    def find(self, key):
        return self.get(key)

    def save(self, key, part):
        self[key] = part


def test_a_part_is_made_once_of_the_same_content():
    shelf = Shelf()
    asked = []

    def made(made_from, scope="a"):
        return Memory(scope, shelf).part("picture", made_from, lambda: asked.append(made_from) or len(asked))

    assert made((box_mesh((1.0, 2.0, 3.0)), {"colour": 1.0})) == 1
    assert made((box_mesh((1.0, 2.0, 3.0)), {"colour": 1.0})) == 1
    assert made((box_mesh((1.0, 2.0, 3.1)), {"colour": 1.0})) == 2
    assert made((box_mesh((1.0, 2.0, 3.0)), {"colour": 2.0})) == 3
    assert made((box_mesh((1.0, 2.0, 3.0)), {"colour": 1.0}), scope="b") == 4


def test_without_a_store_each_part_is_made():
    memory, asked = Memory(), []

    assert memory.part("p", 1, lambda: asked.append(0) or "x") == memory.part("p", 1, lambda: asked.append(0) or "x") == "x"
    assert len(asked) == 2


MESH = box_mesh((1.0, 2.0, 3.0))


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (1, 1.0),
        (1, True),
        ("1", 1),
        ("1", b"1"),
        ((1, 2), [1, 2]),
        (("ab", "c"), ("a", "bc")),
        (((1,), 2), (1, (2,))),
        ((None,), ()),
        ({"a": None}, ("a", None)),
        (np.zeros((2, 3)), np.zeros((3, 2))),
        (np.zeros(2), np.zeros(2, dtype=np.int64)),
        (np.zeros(2), (0.0, 0.0)),
        (np.array([0.0, 1.0]), np.array([0.0, np.nextafter(1.0, 2.0)])),
        (MESH, replace(MESH, faces=MESH.faces[::-1])),
        (MESH, replace(MESH, cad_faces=np.zeros(len(MESH.faces), dtype=np.int64))),
    ],
)
def test_different_contents_have_different_keys(one, other):
    memory = Memory()

    assert memory.key("n", one) != memory.key("n", other)
    assert memory.key("n", one) == Memory().key("n", one)
    assert memory.key("m", one) != memory.key("n", one)


def test_what_has_no_content_is_refused():
    with pytest.raises(TypeError, match="function"):
        Memory().key("n", test_what_has_no_content_is_refused)
