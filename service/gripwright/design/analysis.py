"""The analysis of meshes, as a whole: prepared, segmented, fitted, and the better one kept where the plan asks for the best."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from gripwright.design.plan import Plan
from gripwright.design.runner import Ref, Runner
from gripwright.domain.errors import Rejection


class AnalysedMesh(NamedTuple):
    """What became of a mesh: refs of its `PreparedShape` and its `Analysis`, or why there is none."""

    prepared: Ref
    analysis: Ref | Rejection


def analyse(meshes: Sequence[Ref], plan: Plan, runner: Runner) -> dict[Ref, AnalysedMesh]:
    """Prepare each distinct mesh, and segment and fit it with each segmenter of the plan; each stage runs on all at once."""
    distinct = list(dict.fromkeys(meshes))
    prepared = runner.map("prepare", [{"mesh": {"ref": mesh}} for mesh in distinct])
    tried = [(shape, key) for shape in prepared for key in plan.segmenters]
    segmented = runner.map("segment", [{"prepared": {"ref": shape}, "segmenter": key} for shape, key in tried])
    answers = [runner.get(ref) for ref in segmented]
    usable = [number for number, answer in enumerate(answers) if not isinstance(answer, Rejection)]
    fitted = runner.map(
        "fit", [{"prepared": {"ref": tried[number][0]}, "segmentation": {"ref": segmented[number]}} for number in usable]
    )
    analyses = dict(zip(usable, fitted, strict=True))
    found: dict[Ref, list[Ref]] = {shape: [analyses[k] for k in usable if tried[k][0] == shape] for shape in prepared}
    refused = {shape: answer for (shape, _), answer in zip(tried, answers, strict=True) if isinstance(answer, Rejection)}
    kept = _kept(found, runner)
    return {
        mesh: AnalysedMesh(prepared=shape, analysis=kept[shape] if shape in kept else refused[shape])
        for mesh, shape in zip(distinct, prepared, strict=True)
    }


def _kept(found: Mapping[Ref, Sequence[Ref]], runner: Runner) -> dict[Ref, Ref]:
    """One analysis of each prepared shape that has any."""
    several = [shape for shape, analyses in found.items() if len(analyses) > 1]
    chosen = runner.map("keep", [{"analyses": _refs(found[shape])} for shape in several])
    only = {shape: analyses[0] for shape, analyses in found.items() if len(analyses) == 1}
    return {**only, **dict(zip(several, chosen, strict=True))}


def _refs(refs: Iterable[Ref]) -> list[Any]:
    return [{"ref": ref} for ref in refs]
