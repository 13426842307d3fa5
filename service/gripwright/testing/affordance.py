"""Checks of affordance detectors: regions of the prepared mesh, with evidence."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from gripwright.domain.affordance import MARKED, Forbidden
from gripwright.domain.assembly import GraspRegion
from gripwright.testing.trial import Case, Check, Trial


def cases(trial: Trial) -> list[Case]:
    """One a component, its second segment marked as not to be touched."""
    marked = (GraspRegion(reason="ground surface", segments=(1,)),)
    return [
        Case(
            name=sample.name,
            method="detect",
            arguments={"component": replace(sample.component, no_grasp=marked), "segments": sample.segments},
        )
        for sample in trial.components
    ]


def regions(trial: Trial) -> Iterable[str]:
    """Each region is of the component's faces, and says who found it and why."""
    for case, found in trial.answers():
        if not isinstance(found, Sequence) or not all(isinstance(region, Forbidden) for region in found):
            yield f"{case.name}: detect returns {type(found).__name__}, not a sequence of Forbidden"
            continue
        faces = len(case.arguments["component"].mesh.faces)
        for region in found:
            yield from (f"{case.name}: {fault}" for fault in _region_faults(region, trial.plugin.key, faces))


def _region_faults(region: Forbidden, key: str, faces: int) -> Iterable[str]:
    if region.faces.dtype != np.bool_ or region.faces.shape != (faces,):
        yield f"faces are {region.faces.dtype} {region.faces.shape}, bool ({faces},) is needed"
    if region.detector not in (key, MARKED):
        yield f"detector is {region.detector!r}, the key is {key!r}"
    if not region.reason:
        yield "a region has no reason"
    if (region.box_min_C is None) != (region.box_max_C is None):
        yield "a box needs both corners"
    try:
        json.dumps(region.evidence, allow_nan=False)
    except (TypeError, ValueError) as error:
        yield f"evidence is not JSON: {error}"


CHECKS = (Check("regions", "each region is of the component's faces and has a reason", regions),)
