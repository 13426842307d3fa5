"""Distributions of plug-ins, installed as pip leaves them, are found; broken ones are reported and harm nothing."""

import json
import os
import sys

import pytest

from gripwright.design.plan import plan_of
from gripwright.domain.errors import InvalidPlan
from gripwright.plugin_api.checks import PROTOCOLS
from gripwright.plugin_api.deprecation import Deprecation, deprecations_of
from gripwright.plugin_api.manifest import API_VERSION, KINDS, Manifest
from gripwright.registry.building import build_toolbox
from gripwright.registry.description import RegistryUnreadable, check_options, describe, describe_in_child
from gripwright.registry.discovery import PluginLoadError, load_registry
from plugin_factory import ALL_KINDS, FAKE_OPTIONS, install

GOOD = "gripwright-good"


@pytest.fixture
def site(tmp_path, monkeypatch):
    """An empty folder on the path, for this process and its children; modules from it are forgotten afterwards."""
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]))
    before = set(sys.modules)
    yield tmp_path
    for name in set(sys.modules) - before:
        del sys.modules[name]


@pytest.fixture
def good(site):
    install(site, GOOD, ALL_KINDS)
    return site


def load(*distributions, **options):
    return load_registry(allow=distributions, **options)


def test_an_installed_distribution_is_found_with_all_its_plugins(good):
    registry = load(GOOD)

    assert not registry.failures
    assert {plugin.name for plugin in registry.plugins} == {f"{kind}/fake" for kind in KINDS}
    assert {(plugin.distribution, plugin.version) for plugin in registry.plugins} == {(GOOD, "1.0")}


def test_the_builtin_plugins_keep_the_contract():
    registry = load("gripwright", strict=True)

    assert {plugin.distribution for plugin in registry.plugins} == {"gripwright"}
    assert build_toolbox(plan_of({}), registry).versions


def test_what_is_not_allowed_is_not_imported(good):
    assert not load("gripwright-other").plugins
    assert "gripwright_good" not in sys.modules


@pytest.mark.parametrize(
    ("old", "new", "plugin", "reason"),
    [
        ("def segment(self, component, ctx)", "def segment(self, component)", "segmenter/fake", "segment must take"),
        ("def segment(self, component, ctx)", "def segment(self, ctx, component)", "segmenter/fake", "segment must take"),
        ("def segment(self, component, ctx)", "async def segment(self, component, ctx)", "segmenter/fake", "plain function"),
        ("def detect(", "def find(", "affordance/fake", "has no method detect"),
        (
            "def fit(self, component, segment, ctx)",
            "def fit(self, component, segment, ctx, more)",
            "fitter/fake",
            "fit must take",
        ),
        ('accepts = frozenset({"cylinder"})', 'accepts = ["cylinder"]', "rule/fake", "accepts must be a class variable"),
        ('accepts = frozenset({"cylinder"})', "accepts = frozenset({1})", "rule/fake", "accepts must hold strings"),
        ("fingers = 2", "", "hand/fake", "fingers must be a class variable"),
        ('key = "fake"\n\n    def segment', 'key = "other"\n\n    def segment', "segmenter/fake", "its key is 'other'"),
        ("rays: int = Field(30,", "rays: int = Field(", "segmenter/fake", "cannot be built with its default parameters"),
        ("class Settings(Params)", "class Settings", "segmenter/fake", "must be a subclass of Params"),
        ("    def __init__(self, params):", "    def __init__(self):", "segmenter/fake", "cannot be built"),
        *(
            (
                'version="1.0", api_version=API_VERSION',
                f'version="1.0", api_version="{version}"',
                "gripwright_bad",
                f"made for plug-in API {version}, this is {API_VERSION}: versions from 1.0 to {API_VERSION} load",
            )
            for version in ("2.0", "1.99", "0.9", "new")
        ),
        ("manifest = Manifest(", "manifest = dict(", "gripwright_bad", "not a Manifest"),
        ("CLASSES = {", "import no_such_module\nCLASSES = {", "gripwright_bad", "No module named 'no_such_module'"),
        ("CLASSES = {", "raise SystemExit(3)\nCLASSES = {", "gripwright_bad", "SystemExit"),
        ('"segmenter": Segmenter,', '"divider": Segmenter,', "divider/fake", "there is no kind 'divider'"),
    ],
)
def test_a_broken_distribution_is_reported_whole_and_the_good_one_stays(good, old, new, plugin, reason):
    assert old in ALL_KINDS
    install(good, "gripwright-bad", ALL_KINDS.replace(old, new, 1))

    alone = load("gripwright-bad")
    both = load(GOOD, "gripwright-bad")

    assert not alone.plugins
    (failure,) = alone.failures
    assert (failure.distribution, failure.plugin) == ("gripwright-bad", plugin)
    assert reason in failure.reason
    assert {item.distribution for item in both.plugins} == {GOOD}


@pytest.mark.parametrize("version", ["1.0", "1.1", API_VERSION])
def test_a_plugin_for_an_earlier_version_of_the_contract_loads(site, version):
    install(site, GOOD, ALL_KINDS.replace("api_version=API_VERSION", f'api_version="{version}"'))

    registry = load(GOOD, strict=True)

    assert len(registry.plugins) == len(KINDS)
    assert {plugin.warnings for plugin in registry.plugins} == {()}


def test_what_is_deprecated_loads_with_a_warning_for_whoever_lists_it(site):
    install(site, GOOD, ALL_KINDS.replace('version="1.0"', 'name="old", version="1.0"'))

    described = describe(load(GOOD, strict=True))["plugins"]

    assert len(described) == len(KINDS)
    for plugin in described:
        assert plugin["warnings"] == [
            "Manifest.name is deprecated since plug-in API 1.2 and gone in 2.0: leave it out, the distribution's own name is used"
        ]


def test_a_deprecated_member_of_a_protocol_warns_the_kinds_that_have_it(good):
    member = Deprecation(owner="HandModel", member="opening_floor_mm", since="1.7", instead="say it otherwise")
    manifest = Manifest(version="1.0", api_version="1.0", plugins=())
    found = {
        plugin.kind: deprecations_of(manifest, plugin.plugin, PROTOCOLS[plugin.kind], [member]) for plugin in load(GOOD).plugins
    }

    assert {kind: warnings for kind, warnings in found.items() if warnings} == {
        "hand": ("HandModel.opening_floor_mm is deprecated since plug-in API 1.7 and gone in 2.0: say it otherwise",)
    }


def test_a_key_that_is_taken_refuses_the_second_distribution(good):
    install(good, "gripwright-second", ALL_KINDS)

    registry = load(GOOD, "gripwright-second")

    assert {plugin.distribution for plugin in registry.plugins} == {GOOD}
    (failure,) = registry.failures
    assert failure.distribution == "gripwright-second"
    assert "taken by gripwright-good" in failure.reason


def test_strict_loading_raises(good):
    install(good, "gripwright-bad", "raise RuntimeError('broken')")

    with pytest.raises(PluginLoadError, match="broken"):
        load(GOOD, "gripwright-bad", strict=True)


def test_an_optional_further_argument_is_no_fault(site):
    install(site, GOOD, ALL_KINDS.replace("def segment(self, component, ctx)", "def segment(self, component, ctx, deep=False)"))

    assert not load(GOOD).failures


def test_a_toolbox_holds_the_plugins_of_the_plan_with_its_parameters(good):
    toolbox = build_toolbox(plan_of({**FAKE_OPTIONS, "fake.rays": 5}), load(GOOD))

    assert toolbox.segmenters["fake"].params.rays == 5
    assert toolbox.versions["segmenter/fake"] == {"distribution": GOOD, "version": "1.0", "params": {"rays": 5}}
    assert set(toolbox.hands) == {"parallel-2"}


FAULTS = [
    ({"segmenter": "magic"}, {"/options/segmenter"}),
    ({"fitters": ["fake", "magic"]}, {"/options/fitters/1"}),
    ({"fitters": ["fake", "fake"]}, {"/options/fitters/1"}),
    ({"fake.rays": 0}, {"/options/fake.rays"}),
    ({"fake.rays": "5"}, {"/options/fake.rays"}),
    ({"fake.rays": float("nan")}, {"/options/fake.rays"}),
    ({"fake.beams": 5}, {"/options/fake.beams"}),
    ({"fake.rays": 7.0}, {"/options/fake.rays"}),
    ({"magic.rays": 5}, {"/options/magic"}),
    (
        {"segmenter": "magic", "optimizer": "luck", "fake.rays": 0},
        {"/options/segmenter", "/options/optimizer", "/options/fake.rays"},
    ),
]


@pytest.mark.parametrize(("options", "pointers"), FAULTS)
def test_all_faults_of_a_plan_are_told_together_at_their_places(good, options, pointers):
    registry = load(GOOD)
    given = {**FAKE_OPTIONS, **options}

    with pytest.raises(InvalidPlan) as by_models:
        build_toolbox(plan_of(given), registry)
    with pytest.raises(InvalidPlan) as by_schemas:
        check_options(given, describe(registry))

    assert {fault.pointer for fault in by_models.value.faults} == pointers
    assert by_schemas.value.faults == by_models.value.faults


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"fake.rays": 2000}, "2000 is greater than the maximum of 1000"),
        ({"fake.rays": 7.5}, "7.5 is not of type 'integer'"),
        ({"fake.beams": 5}, "there is no such parameter; there is rays"),
    ],
)
def test_a_fault_of_a_parameter_is_told_once_with_the_value_and_the_limit(good, options, message):
    with pytest.raises(InvalidPlan) as refused:
        build_toolbox(plan_of({**FAKE_OPTIONS, **options}), load(GOOD))

    assert [fault.message for fault in refused.value.faults] == [message]


def test_the_place_of_a_parameter_is_where_it_was_given(good):
    with pytest.raises(InvalidPlan) as refused:
        check_options({**FAKE_OPTIONS, "fake": {"rays": -1, "beams": 1}, "fake.rays": 0}, describe(load(GOOD)))

    assert {fault.pointer for fault in refused.value.faults} == {"/options/fake.rays", "/options/fake/beams"}


def test_an_unknown_key_is_answered_with_what_exists(good):
    with pytest.raises(InvalidPlan) as refused:
        check_options({**FAKE_OPTIONS, "segmenter": "magic"}, describe(load(GOOD)))

    assert "installed: fake" in refused.value.faults[0].message


@pytest.mark.parametrize("options", [{"segmenter": "late"}, {"late.rays": 5}])
def test_a_key_that_is_not_there_is_answered_with_what_did_not_load(good, options):
    install(good, "gripwright-late", "raise RuntimeError('broken')")

    with pytest.raises(InvalidPlan) as refused:
        check_options({**FAKE_OPTIONS, **options}, describe(load(GOOD, "gripwright-late")))

    assert refused.value.faults[0].message.endswith("not loaded: gripwright-late, `gripwright plugins` and GET /plugins say why")


@pytest.mark.parametrize(
    ("options", "detail"),
    [
        ({"fake.rays": 0}, "the options have faults"),
        ({"fake.rays": 0, "segmenter": "magic"}, "the plan cannot be run with what is installed"),
    ],
)
def test_a_plan_is_said_not_to_run_with_what_is_installed_only_where_a_plugin_is_missing(good, options, detail):
    with pytest.raises(InvalidPlan) as refused:
        check_options({**FAKE_OPTIONS, **options}, describe(load(GOOD)))

    assert refused.value.detail == detail


def test_the_papers_plan_is_the_papers_method_whatever_else_is_asked():
    description = describe(load("gripwright"))

    plan = check_options({"plan": "paper"}, description)
    with pytest.raises(InvalidPlan) as refused:
        check_options({"plan": "paper", "fitters": ["cylinder"]}, description)

    assert (plan.segmenter, plan.fitters) == ("sdf", ("cylinder", "box"))
    assert refused.value.faults[0].pointer == "/options/fitters"


def test_the_description_is_json_and_comes_from_a_child_that_imports_in_our_place(good):
    install(good, "gripwright-bad", "raise RuntimeError('broken')")

    description = describe_in_child(allow=(GOOD, "gripwright-bad"))

    assert json.loads(json.dumps(description)) == description
    segmenter = next(plugin for plugin in description["plugins"] if plugin["kind"] == "segmenter")
    assert segmenter["summary"] == "Divides nothing."
    assert segmenter["options"]["properties"]["rays"]["maximum"] == 1000
    assert [failure["distribution"] for failure in description["failures"]] == ["gripwright-bad"]
    assert "gripwright_good" not in sys.modules


def test_a_plugin_that_crashes_at_import_does_not_crash_us(site):
    install(site, "gripwright-crash", "import ctypes\nctypes.string_at(0)")

    with pytest.raises(RegistryUnreadable, match="ended with code -11 while gripwright-crash was loaded"):
        describe_in_child(allow=("gripwright", "gripwright-crash"))


def test_a_plugin_that_hangs_at_import_is_given_up_and_named(site):
    install(site, "gripwright-hang", "while True: pass")

    with pytest.raises(RegistryUnreadable, match="took more than 5 s while gripwright-hang was loaded"):
        describe_in_child(allow=("gripwright-hang",), timeout_s=5.0)
