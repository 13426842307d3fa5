"""Checks of fitters: primitives in mm that can be written as JSON."""

import dataclasses
import json
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from gripwright.domain.errors import Rejection
from gripwright.domain.shape import DrawnPrimitive, Mesh, Primitive
from gripwright.geometry.adjacency import face_adjacency
from gripwright.geometry.measures import volume_mm3 as drawn_mm3
from gripwright.testing.samples import fake_context
from gripwright.testing.trial import OWN_SAMPLES, Case, Check, Trial, is_length

_SCALE = 10.0
_NEAR = 100.0
_PICTURE = 0.02  # tessellation of what is drawn


def cases(trial: Trial) -> list[Case]:
    """One a segment of each component."""
    return [
        Case(
            name=f"{sample.name}, segment {segment.id}",
            method="fit",
            arguments={"component": sample.component, "segment": segment},
        )
        for sample in trial.components
        for segment in sample.segments
    ]


def fits(trial: Trial) -> Iterable[str]:
    """Some sample is of the shape that it looks for, one of the author's own where there are any."""
    if refused := trial.refused_own("segments", "a primitive"):
        yield refused
    elif not any(trial.answers()):
        yield (
            f"none of {len(trial.runs)} segments is answered with a primitive, so json, unit, picture and scale have nothing "
            f"to look at; give samples of the shape: {OWN_SAMPLES}"
        )


def primitive(trial: Trial) -> Iterable[str]:
    """A frozen dataclass that keeps the Protocol, or a Rejection that says why."""
    for run in trial.runs:
        faults = _rejection_faults(run.answer) if isinstance(run.answer, Rejection) else _primitive_faults(run.answer)
        yield from (f"{run.case.name}: {fault}" for fault in faults)


def _rejection_faults(rejection: Rejection) -> Iterable[str]:
    if not (rejection.code and rejection.detail):
        yield "a Rejection needs a code and a sentence"


def _primitive_faults(answer: Any) -> Iterable[str]:
    if not isinstance(answer, Primitive):
        yield f"fit returns {type(answer).__name__}, neither a Primitive nor a Rejection"
        return
    if not (dataclasses.is_dataclass(answer) and type(answer).__dataclass_params__.frozen):
        yield f"{type(answer).__name__} is not a frozen dataclass"
    if not (isinstance(answer.kind, str) and answer.kind):
        yield f"kind is {answer.kind!r}, not a name"
    if not is_length(answer.volume_mm3):
        yield f"volume_mm3 is {answer.volume_mm3}"
    if not (np.isfinite(answer.rms_mm) and answer.rms_mm >= 0):
        yield f"rms_mm is {answer.rms_mm}"
    if not isinstance(answer.surface_filled, bool):
        yield f"surface_filled is a {type(answer.surface_filled).__name__}, not a bool"


def named(trial: Trial) -> Iterable[str]:
    """The manifest names the class, so that results can hold it."""
    return (f"fit returned {fault}" for fault in trial.unnamed(answer for _, answer in trial.answers()))


def as_json(trial: Trial) -> Iterable[str]:
    """`to_dict` holds JSON values."""
    for case, answer in trial.answers():
        try:
            content = answer.to_dict()
            same = json.loads(json.dumps(content, allow_nan=False)) == content
        except (TypeError, ValueError) as error:
            yield f"{case.name}: to_dict is not JSON: {error}"
            continue
        if not same or not isinstance(content, Mapping):
            yield f"{case.name}: to_dict must be a dict that is the same after a round trip through JSON"
        elif "kind" in content:
            yield f"{case.name}: to_dict must leave out kind, the host adds it"


def unit(trial: Trial) -> Iterable[str]:
    """The volume is in mm³: of the order of the segment's hull."""
    for case, answer in trial.answers():
        hull = case.arguments["segment"].hull_volume_mm3
        if not hull / _NEAR <= answer.volume_mm3 <= hull * _NEAR:
            yield (
                f"{case.name}: the {answer.kind} has {answer.volume_mm3:.3g} mm³, the hull of its segment {hull:.3g} mm³; "
                "lengths are mm"
            )


def scale(trial: Trial) -> Iterable[str]:
    """Ten times the size gives ten times the lengths."""
    answered = {run.case.name: run.answer for run in trial.runs}
    for sample in trial.components:
        larger = sample.scaled(_SCALE)
        for segment in larger.segments:
            name = f"{sample.name}, segment {segment.id}"
            small = answered[name]
            if isinstance(small, Rejection):
                continue
            large = trial.instance().fit(component=larger.component, segment=segment, ctx=fake_context(seed=7))
            if isinstance(large, Rejection):
                continue  # a limit in mm may be a parameter
            ratio = large.volume_mm3 / small.volume_mm3
            if not np.isclose(ratio, _SCALE**3, rtol=0.01):
                yield f"{name}: at 10 times the size the volume is {ratio:.4g} times as large, 1000 times was expected"


def picture(trial: Trial) -> Iterable[str]:
    """What a primitive draws of itself is a closed solid of its volume."""
    for case, answer in trial.answers():
        if not isinstance(answer, DrawnPrimitive):
            continue
        mesh = answer.drawn()
        if not isinstance(mesh, Mesh):
            yield f"{case.name}: drawn returns {type(mesh).__name__}, not a Mesh"
            continue
        adjacency = face_adjacency(mesh)
        if adjacency.open_edges or adjacency.non_manifold_edges:
            edges = f"{adjacency.open_edges} open and {adjacency.non_manifold_edges} non-manifold edges"
            yield f"{case.name}: drawn is not closed, it has {edges}"
        volume = drawn_mm3(mesh)
        if not np.isclose(volume, answer.volume_mm3, rtol=_PICTURE):
            yield (
                f"{case.name}: drawn holds {volume:.4g} mm³, volume_mm3 is {answer.volume_mm3:.4g}; "
                f"at most {100 * _PICTURE:.0f} % apart"
            )


CHECKS = (
    Check("fits", "some sample is answered with a primitive, and one of the author's own", fits),
    Check("primitive", "a primitive keeps its Protocol, a no has a code and a sentence", primitive),
    Check("named", "the manifest names the class of a primitive", named),
    Check("json", "to_dict holds JSON values", as_json),
    Check("unit", "lengths are mm", unit),
    Check("picture", "what a primitive draws of itself is closed and has its volume", picture),
    Check("scale", "ten times the size gives ten times the lengths", scale),
)
