"""Malformed uploads, made by code: every one must be refused. the same in each run."""

import json

from archive_files import bad_archives, bombs
from manifest_files import bad_manifests, large_manifests
from multipart_bodies import bad_requests
from polygon_files import bad_polygon_files
from scene_files import bad_scene_files
from step_files import bad_step_files
from upload_bodies import BadUpload, alone, component, document, form, package_of, stl, zipped


def corpus():
    """All of it; what is large to make or dear to refuse comes last."""
    yield from small_corpus()
    for name, data in bombs():
        yield BadUpload("bomb", name, alone(data))
    for name, data in large_manifests():
        yield BadUpload("large manifest", name, alone(zipped([("product.json", data), ("part.stl", stl())])))


def small_corpus():
    """What is made and refused in a moment."""
    for format, name, data in (*bad_polygon_files(), *bad_scene_files()):
        yield BadUpload(format, name, package_of(data, format))
    for name, data in bad_step_files():
        yield BadUpload("step", name, package_of(data, "step"))
        yield BadUpload("step alone", name, alone(data, "part.step"))
    for name, data in bad_archives():
        yield BadUpload("zip", name, alone(data))
    for name, data in bad_manifests():
        yield BadUpload("manifest", name, alone(zipped([("product.json", data), ("part.stl", stl())])))
        yield BadUpload("manifest part", name, form(("manifest", "product.json", data), ("files", "part.stl", stl())))
    yield from bad_requests()
    crashes = [("product.json", json.dumps(document(*(component(f"{k}.step", None, f"c{k}") for k in range(200)))))]
    crashes += [(f"{k}.step", b"ISO-10303-21;\nDATA;\n#1 = PRODUCT(" + b"(" * 50_000) for k in range(200)]
    yield BadUpload("zip", "200 STEP files that each end the process that reads them", alone(zipped(crashes)))
