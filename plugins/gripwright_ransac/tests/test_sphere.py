"""The fitter keeps the contract, recovers what meshes were built with, and leaves the library's globals alone."""

import random

import numpy as np
import pytest
from gripwright_ransac.sphere import RansacSphere, RansacSphereFitter, RansacSphereParams

from gripwright.domain.errors import Rejection
from gripwright.testing import fake_context, parametrize_with_checks, sample_components

SAMPLES = {sample.name: sample for sample in sample_components()}


def fitted(sample, segment=0, seed=0, **params):
    return RansacSphereFitter(RansacSphereParams(**params)).fit(
        sample.component, sample.segments[segment], fake_context(seed=seed)
    )


@parametrize_with_checks([RansacSphereFitter])
def test_it_keeps_the_contract(plugin, check):
    assert check(plugin) == []


@pytest.mark.parametrize("name", ["ball", "tilted ball"])
@pytest.mark.parametrize("factor", [1.0, 50.0])
def test_a_sphere_is_recovered_wherever_it_lies_and_however_large_it_is(name, factor):
    sample = SAMPLES[name].scaled(factor)

    sphere = fitted(sample)

    assert isinstance(sphere, RansacSphere)
    assert sphere.radius_mm == pytest.approx(12.0 * factor, rel=1e-6)
    assert np.allclose(sphere.center_C, sample.component.mesh.vertices_mm.mean(axis=0), atol=1e-3 * factor)
    assert sphere.surface_filled


@pytest.mark.parametrize("name", sorted(set(SAMPLES) - {"ball", "tilted ball"}))
def test_other_shapes_are_no_spheres(name):
    for segment in SAMPLES[name].segments:
        answer = fitted(SAMPLES[name], segment.id)

        assert isinstance(answer, Rejection)
        assert answer.code == "no-sphere"


def test_what_others_draw_is_not_changed():
    random.seed(3)
    expected = random.random()
    random.seed(3)

    fitted(SAMPLES["ball"])

    assert random.random() == expected
