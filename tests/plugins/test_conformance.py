"""The conformance suite passes what is built in and names the fault of each bad plug-in."""

import signal
import time
from dataclasses import replace

import numpy as np
import pytest
from bad_import import ImportsTheService
from bad_plugins import (
    EXPECTED,
    FitsWhatNoManifestNames,
    Fitter,
    Marble,
    MarbleHolder,
    MarbleRefuser,
    MovesTheMesh,
    NeverFits,
    NeverReturns,
    NoCones,
    OneTypeOfFinger,
    Segmenter,
)

from gripwright.design.analysis import analyse
from gripwright.design.plan import plan_of
from gripwright.domain.errors import PluginFailure
from gripwright.geometry.adjacency import face_adjacency
from gripwright.geometry.measures import volume_mm3
from gripwright.plugin_api.manifest import KINDS
from gripwright.registry.building import build_toolbox
from gripwright.registry.discovery import InstalledPlugin, Registry, load_registry, load_samples
from gripwright.testing import (
    check_plugin,
    checks_for,
    fake_context,
    kind_of,
    parametrize_with_checks,
    sample_components,
)
from gripwright.testing.time_limit import TimeUp, time_limit
from here_runner import HereRunner

BUILT_IN = load_registry(allow=("gripwright",), strict=True).plugins


def checks_with_own_samples():
    """Of each built-in plug-in, asked the samples that its manifest names; all manifests together name the primitives."""
    primitives = frozenset(cls for plugin in BUILT_IN for cls in plugin.record_classes)
    return [
        case
        for plugin in BUILT_IN
        for case in parametrize_with_checks([plugin.plugin], samples=load_samples(plugin), primitives=primitives).args[1]
    ]


@pytest.mark.parametrize(("plugin", "check"), checks_with_own_samples())
def test_every_built_in_plugin_passes(plugin, check):
    assert check(plugin) == []


@pytest.mark.parametrize("good", [Fitter, Segmenter, OneTypeOfFinger])
def test_what_the_bad_plugins_are_made_from_is_good(good):
    assert check_plugin(good) == []


@pytest.mark.parametrize("bad", EXPECTED, ids=lambda bad: bad.__name__)
def test_a_bad_plugin_is_rejected_by_a_message_that_names_its_fault(bad):
    named = () if "NoManifestNames" in bad.__name__ else None

    findings = check_plugin(bad, primitives=named, time_limit_s=1.0 if bad is NeverReturns else 60.0)

    assert any(EXPECTED[bad] in str(finding) for finding in findings), "\n".join(map(str, findings)) or "no finding"
    assert len({finding.check for finding in findings}) <= 2, "one fault, and what follows from it"


def test_a_design_names_the_fitter_whose_primitive_no_manifest_names():
    unnamed = InstalledPlugin(
        kind="fitter", key="slotted", plugin=FitsWhatNoManifestNames, version="0.3.0", distribution="gripwright-slotted"
    )
    plan = plan_of({"fitters": ["slotted"]})
    runner = HereRunner(plan, build_toolbox(plan, Registry(plugins=(*BUILT_IN, unnamed))))

    with pytest.raises(PluginFailure) as failure:
        analyse([runner.put(sample_components()[0].component.mesh)], plan, runner)

    assert failure.value.detail == (
        "fitter/slotted (gripwright-slotted 0.3.0) returned SlottedBox, which its PluginEntry.primitives does not name: "
        'add "bad_plugins:SlottedBox" to it'
    )
    assert failure.value.context == {"stage": "fit", "plugin": "fitter/slotted"}


def test_a_good_fitter_of_a_shape_that_no_sample_has_is_told_to_bring_samples():
    torus = next(plugin for plugin in BUILT_IN if plugin.name == "fitter/torus")

    (finding,) = check_plugin(torus.plugin)

    assert finding.check == "fits"
    assert "give samples of the shape: as `samples` of its PluginEntry, and of check_plugin" in finding.detail


def test_a_fitter_that_refuses_all_samples_of_its_author_fails_though_it_fits_a_built_in_one():
    cone = replace(sample_components()[4], name="my cone")

    (finding,) = check_plugin(NoCones, samples=[cone, cone.tilted()])

    assert str(finding) == (
        "fits: none of 2 segments of your own samples is answered with a primitive; "
        "'my cone, segment 0' got no-box: a cone is no box"
    )


def test_a_fitter_that_refuses_every_sample_is_told_why_of_the_first_that_its_author_gave():
    (finding,) = check_plugin(NeverFits, samples=[replace(sample_components()[4], name="my cone")])

    assert str(finding) == (
        "fits: none of 19 segments, 1 of them of your own samples, is answered with a primitive; "
        "'my cone, segment 0' got no-box: the surface of 1073 mm² is no box"
    )


def test_a_rule_that_refuses_all_primitives_of_its_author_fails():
    (finding,) = check_plugin(MarbleRefuser, samples=[Marble(radius_mm=30.0), Marble(radius_mm=2.0)])

    assert str(finding) == (
        "accepts: none of 2 sample primitives, 2 of them of your own samples, is answered with a requirement; "
        "'own sample 0, marble' got no-type: a marble of 30 mm is held by nothing"
    )


def test_one_fault_of_many_samples_is_told_once():
    (finding,) = check_plugin(MovesTheMesh)

    assert finding.check == "arguments unchanged"
    assert finding.detail.endswith("fit changes its argument ['component'].mesh.vertices_mm (and 17 more like it)")


def test_a_rule_is_asked_of_primitives_of_the_authors_own():
    (finding,) = check_plugin(MarbleHolder, samples=[Marble(radius_mm=30.0)])

    assert str(finding) == (
        "requirements: own sample 0, marble: opening_width_mm is 0.06 for a primitive of at most 2.42e+03 mm; lengths are mm"
    )


@pytest.mark.parametrize(
    ("spoilt", "words"),
    [
        (lambda sample: replace(sample, segments=sample.segments[:1]), "its segments do not hold each of its 380 faces once"),
        (lambda sample: replace(sample, name="ball"), "sample 'ball': the name is taken by another sample"),
        (lambda sample: sample.component.mesh, "sample 0 is a Mesh, neither a Sample nor a Primitive"),
    ],
)
def test_samples_that_cannot_be_asked_are_refused(spoilt, words):
    shaft = replace(sample_components()[0], name="my shaft")

    (finding,) = check_plugin(Fitter, samples=[spoilt(shaft)])

    assert finding.check == "samples"
    assert words in finding.detail


def test_a_kind_is_known_by_its_methods():
    assert {plugin.name for plugin in BUILT_IN if kind_of(plugin.plugin) != plugin.kind} == set()


def test_an_import_of_the_service_is_named():
    (finding,) = check_plugin(ImportsTheService)

    assert finding.check == "imports"
    assert "imports gripwright.design.plan" in finding.detail


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_has_checks_of_its_own_beside_the_general_ones(kind):
    names = [check.name for check in checks_for(kind)]

    assert len(set(names)) == len(names)
    assert set(names) > set.intersection(*({check.name for check in checks_for(other)} for other in KINDS))


def test_samples_are_closed_solids_divided_without_gap_or_overlap():
    for sample in sample_components():
        mesh = sample.component.mesh
        adjacency = face_adjacency(mesh)
        assert adjacency.open_edges == adjacency.non_manifold_edges == 0
        assert volume_mm3(mesh) > 0
        faces = np.concatenate([segment.faces for segment in sample.segments])
        assert np.array_equal(np.sort(faces), np.arange(len(mesh.faces)))
        assert all(len(segment.faces) and segment.hull_volume_mm3 > 0 for segment in sample.segments)


def test_a_tilted_sample_has_the_volume_of_the_upright_one():
    samples = {sample.name: volume_mm3(sample.component.mesh) for sample in sample_components()}

    for name in [name for name in samples if not name.startswith("tilted")]:
        assert samples[f"tilted {name}"] == pytest.approx(samples[name], rel=1e-9)


def test_a_context_has_the_numbers_of_its_seed():
    assert fake_context(seed=3).rng.random() == fake_context(seed=3).rng.random() != fake_context(seed=4).rng.random()


def test_a_time_limit_leaves_the_alarm_of_others_as_it_was():
    before = signal.getitimer(signal.ITIMER_REAL)[0], signal.getsignal(signal.SIGALRM)

    with pytest.raises(TimeUp), time_limit(0.05):
        time.sleep(5.0)

    after = signal.getitimer(signal.ITIMER_REAL)[0], signal.getsignal(signal.SIGALRM)
    assert after[1] == before[1]
    assert (after[0] > 0) == (before[0] > 0)
