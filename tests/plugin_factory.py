"""Distributions of plug-ins written by tests, installed the way pip leaves them: a module and its dist-info."""

from pathlib import Path

ALL_KINDS = '''
from collections.abc import Sequence
from typing import ClassVar

from pydantic import Field

from gripwright.domain.errors import Rejection
from gripwright.plugin_api import API_VERSION, Manifest, Params, PluginEntry


class Settings(Params):
    rays: int = Field(30, ge=1, le=1000, description="how many")


class Basic:
    """A plug-in that does nothing.

    More about it.
    """

    params_model: ClassVar[type[Settings]] = Settings

    def __init__(self, params):
        self.params = params


class Segmenter(Basic):
    """Divides nothing."""

    key = "fake"

    def segment(self, component, ctx):
        return []


class Fitter(Basic):
    key = "fake"

    def fit(self, component, segment, ctx):
        return Rejection("none", "fits nothing")


class Affordance(Basic):
    key = "fake"

    def detect(self, component, segments, ctx):
        return []


class Rule(Basic):
    key = "fake"
    accepts = frozenset({"cylinder"})

    def apply(self, fit):
        return Rejection("none", "no rule")


class Hand(Basic):
    key = "fake"
    gripper_type = "parallel-2"
    fingers = 2

    def finger_poses(self, opening_width_mm): ...
    def finger(self, finger_length_mm, grip): ...
    def palm(self, finger_length_mm, envelope_mm, depth_mm): ...
    def opening_floor_mm(self, grip): ...


class Planner(Basic):
    key = "fake"
    gripper_types = frozenset({"parallel-2"})

    def plan(self, component, segment, requirement, hand, ctx):
        return []


class Holding(Basic):
    key = "fake"
    gripper_types = frozenset({"vacuum-1"})

    def seat(self, grasp, surface, hand, ctx): ...
    def contacts(self, grasp, surface, hand, finger_length_mm, ctx): ...
    def hold(self, grasp, contacts, load, component, ctx): ...
    def grip_force_N(self, actuator, opening_width_mm): ...


class Optimizer(Basic):
    key = "fake"

    def solve(self, problem, ctx):
        raise ValueError("solves nothing")


class Finger(Basic):
    key = "fake"
    gripper_types = frozenset({"parallel-2"})

    def design(self, spec, ctx):
        return Rejection("none", "no finger")


class Policy(Basic):
    key = "fake"

    def grip(self, component, segment, requirement, marks):
        return Rejection("none", "nothing is gripped")

    def actuator(self, actuator):
        return Rejection("none", "nothing is bought")


CLASSES = {
    "segmenter": Segmenter, "fitter": Fitter, "affordance": Affordance, "rule": Rule,
    "hand": Hand, "planner": Planner, "holding": Holding, "optimizer": Optimizer, "finger": Finger,
    "policy": Policy,
}
manifest = Manifest(
    version="1.0", api_version=API_VERSION,
    plugins=tuple(PluginEntry(kind=kind, key="fake", target=f"{__name__}:{cls.__name__}") for kind, cls in CLASSES.items()),
)
'''
"""One plug-in of each kind, all with the key `fake`."""

FAKE_OPTIONS = {
    "segmenter": "fake",
    "fitters": ["fake"],
    "affordance": ["fake"],
    "rules": ["fake"],
    "hands": ["fake"],
    "planners": ["fake"],
    "holding": ["fake"],
    "optimizer": "fake",
    "finger": "fake",
    "policies": ["fake"],
}
"""A plan of nothing else."""


def install(folder: Path, distribution: str, source: str, *, version: str = "1.0", target: str = "manifest") -> str:
    """Install a distribution of one module into a folder; the module's name."""
    module = distribution.replace("-", "_")
    (folder / f"{module}.py").write_text(source)
    info = folder / f"{module}-{version}.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {distribution}\nVersion: {version}\n")
    (info / "entry_points.txt").write_text(f"[gripwright.plugins]\n{module} = {module}:{target}\n")
    return module
