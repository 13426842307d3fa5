"""The catalogue of actuators as delivered: figures that makers publish, with source and confidence."""

import json
from importlib import resources

from gripwright.domain.gripper import Actuator


def seed_actuators() -> tuple[Actuator, ...]:
    """The actuators that a new database begins with."""
    text = resources.files(__name__).joinpath("actuators.json").read_text(encoding="utf-8")
    return tuple(Actuator(**figures) for figures in json.loads(text)["actuators"])
