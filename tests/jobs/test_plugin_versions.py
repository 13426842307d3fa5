"""A new version of a plug-in invalidates what it computed and what was made of that, and nothing else."""

import shutil

import numpy as np
import pytest

from gripwright.design import pipeline
from gripwright.design.plan import plan_of
from gripwright.domain.assembly import AssemblyTask, Component, Operation
from gripwright.domain.grasp import CENTRIC_3
from gripwright.domain.gripper import Actuator
from gripwright.geometry import brep
from gripwright.jobs.local import LocalRunner
from gripwright.jobs.steps import Workshop
from plugin_factory import install

OWN = """
from gripwright.domain.preference import INDIFFERENT
from gripwright.plugin_api import Manifest, Params, PluginEntry
from gripwright_builtin.fingers.straight import StraightFinger
from pydantic import Field


class OwnParams(Params):
    beams: int = Field(3, ge=1, le=9, description="how many")


class OwnFinger(StraightFinger):
    key = "own_finger"


class OwnPolicy:
    key = "own_policy"
    params_model = OwnParams

    def __init__(self, params):
        self.params = params

    def grip(self, component, segment, requirement, marks):
        return INDIFFERENT

    def actuator(self, actuator):
        return INDIFFERENT


manifest = Manifest(
    version="{version}", api_version="1.2",
    plugins=(
        PluginEntry(kind="{kind}", key="own_{kind}", target=f"{{__name__}}:{plugin}"),
    ),
)
"""
FINGER, POLICY = ("finger", "OwnFinger"), ("policy", "OwnPolicy")
ACTUATOR = Actuator(
    maker="M", model="a", gripper_type=CENTRIC_3, stroke_mm=10.0, grip_force_N=200.0, opening_max_mm=40.0, mass_kg=0.4
)


@pytest.fixture
def publish(tmp_path, monkeypatch):
    """Installs one of two distributions in a version, in place of the former one."""
    monkeypatch.syspath_prepend(str(tmp_path / "finger"))
    monkeypatch.syspath_prepend(str(tmp_path / "policy"))

    def published(kind, plugin, version):
        site = tmp_path / kind
        shutil.rmtree(site, ignore_errors=True)
        site.mkdir()
        install(site, f"gripwright-own-{kind}", OWN.format(version=version, kind=kind, plugin=plugin), version=version)

    return published


def designed(tmp_path, **options):
    """The stages of which something was computed, and the design document, of a peg that is set down."""
    down = np.stack([np.eye(4)] * 2)
    down[0, 2, 3] = 100.0
    peg = brep.tessellate(brep.cylinder_z(0.0, 0.0, 15.0, 0.0, 60.0), angle_rad=0.1)
    task = AssemblyTask(
        part_number="P",
        revision="A",
        name="",
        components=(Component(id="peg", mesh=peg, X_PC=np.eye(4), density_kg_m3=500.0),),
        obstacles=(),
        operations=(Operation(id="op-1", active=("peg",), passive=(), motion=down),),
    )
    computed = []
    workshop = Workshop(
        data_dir=tmp_path / "data", plugins_allow=("gripwright", "gripwright-own-finger", "gripwright-own-policy")
    )
    plan = plan_of({"finger": "own_finger", "policies": ["own_policy"], **options})
    runner = LocalRunner(workshop, plan, on_progress=lambda fraction, stage, message: computed.append(stage))
    result = runner.get(pipeline.design(task, [ACTUATOR], plan, runner))
    return list(dict.fromkeys(computed)), result.document


def test_a_new_version_computes_its_own_steps_and_what_follows_from_them_again(tmp_path, publish):
    publish(*FINGER, "1.0")
    publish(*POLICY, "1.0")
    first, _ = designed(tmp_path)
    again, _ = designed(tmp_path)

    publish(*FINGER, "1.10")
    after_finger, document = designed(tmp_path)
    publish(*POLICY, "2.0.1")
    after_policy, _ = designed(tmp_path)
    other_params, recorded = designed(tmp_path, **{"own_policy.beams": 5})

    assert again == []
    assert {"prepare", "segment", "fit", "grips", "policies", "constraints", "select", "fingers", "result"} <= set(first)
    assert after_finger == ["tips", "fingers", "verify", "result"]
    assert not {"prepare", "segment", "fit"} & {*after_policy, *other_params}
    assert {"policies", "grips", "result"} <= set(after_policy) & set(other_params)
    assert document["plan"]["plugins"]["finger/own_finger"]["version"] == "1.10"
    assert document["plan"]["plugins"]["policy/own_policy"] == {
        "distribution": "gripwright-own-policy",
        "version": "1.0",
        "params": {"beams": 3},
    }
    assert recorded["plan"]["plugins"]["policy/own_policy"] == {
        "distribution": "gripwright-own-policy",
        "version": "2.0.1",
        "params": {"beams": 5},
    }
