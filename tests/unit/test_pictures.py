import io

import numpy as np
from PIL import Image

from gripwright.cad.colour import PALETTE
from gripwright.report.pictures import picture, shown
from mesh_factory import box_mesh

CUBE = box_mesh((10.0, 10.0, 10.0))
RED, GREEN = (0.9, 0.1, 0.1), (0.1, 0.8, 0.1)


def pixels(png: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)


def beside(x: float) -> np.ndarray:
    X = np.eye(4)
    X[0, 3] = x
    return X


def test_a_picture_has_its_size_a_white_ground_and_the_parts_colour() -> None:
    image = pixels(
        picture([shown(box_mesh((10.0, 10.0, 10.0)), np.eye(4), RED)], direction=(-1, 1.4, -0.8), width=200, height=150)
    )

    assert image.shape == (150, 200, 3)
    assert (image[0, 0] == 255).all()
    red, green, blue = image[75, 100]
    assert red > 2 * green
    assert red > 2 * blue


def test_what_is_in_front_hides_what_is_behind() -> None:
    front, behind = (
        shown(box_mesh((10.0, 10.0, 10.0)), beside(0.0), RED),
        shown(box_mesh((10.0, 10.0, 10.0)), beside(30.0), GREEN),
    )

    seen = pixels(picture([behind, front], direction=(1.0, 0.0, 0.0), width=80, height=80))[40, 40]
    other = pixels(picture([behind, front], direction=(-1.0, 0.0, 0.0), width=80, height=80))[40, 40]

    assert seen[0] > seen[1]
    assert other[1] > other[0]


def test_a_border_between_colours_is_drawn() -> None:
    mesh = box_mesh((10.0, 10.0, 10.0))
    top = np.flatnonzero(mesh.triangles_mm[:, :, 2].min(axis=1) == 10.0)
    colours = np.tile(PALETTE[0], (len(mesh.faces), 1))
    colours[top[0]] = PALETTE[1]

    image = pixels(picture([shown(mesh, np.eye(4), colours)], direction=(0.0, 0.0, -1.0), width=120, height=120))

    diagonal = (
        image[np.arange(30, 90), np.arange(30, 90)].sum(axis=1),
        image[np.arange(30, 90), np.arange(89, 29, -1)].sum(axis=1),
    )
    assert min(line.mean() for line in diagonal) < 0.75 * max(line.mean() for line in diagonal)


def test_the_same_scene_gives_the_same_bytes() -> None:
    def draw() -> bytes:
        return picture([shown(box_mesh((3.0, 4.0, 5.0)), np.eye(4), GREEN)], direction=(-1, 1, -1))

    assert draw() == draw()
