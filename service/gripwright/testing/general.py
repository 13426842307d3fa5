"""The checks that hold for plug-ins of every kind."""

import ast
import gc
import inspect
import json
import pickle
import sys
import time
from collections.abc import Iterable

import numpy as np
from pydantic import ValidationError

from gripwright.domain.errors import Cancelled
from gripwright.domain.shape import Primitive
from gripwright.plugin_api.checks import contract_faults
from gripwright.testing.leaves import first_difference, leaves
from gripwright.testing.samples import Sample, fake_context
from gripwright.testing.trial import Case, Check, Trial

_CONSTRUCTION_S = 0.02
_CALLS, _KEPT_MB = 4, 1.0
_PUBLIC = frozenset({"domain", "geometry", "plugin_api", "testing"})


def contract(trial: Trial) -> Iterable[str]:
    """What can be seen without running it."""
    return contract_faults(trial.plugin, trial.kind, getattr(trial.plugin, "key", ""))


def samples(trial: Trial) -> Iterable[str]:
    """The author's own samples can be asked: components divided into segments, or primitives."""
    names = [sample.name for sample in trial.components]
    for number, sample in enumerate(trial.samples):
        if isinstance(sample, Sample):
            faces, count = np.concatenate([segment.faces for segment in sample.segments]), len(sample.component.mesh.faces)
            if not np.array_equal(np.sort(faces), np.arange(count)):
                yield f"sample {sample.name!r}: its segments do not hold each of its {count} faces once"
            if names.count(sample.name) > 1:
                yield f"sample {sample.name!r}: the name is taken by another sample"
        elif not isinstance(sample, Primitive):
            yield f"sample {number} is a {type(sample).__name__}, neither a Sample nor a Primitive"


def parameters(trial: Trial) -> Iterable[str]:
    """A frozen model that survives JSON and says what each parameter is."""
    model = trial.plugin.params_model
    params = model()
    if model.model_validate_json(params.model_dump_json()) != params:
        yield "params_model: the default parameters are others after a round trip through JSON"
    json.dumps(model.model_json_schema())
    for name, field in model.model_fields.items():
        if not field.description:
            yield f"params_model.{name} has no description"
        try:
            setattr(params, name, getattr(params, name))
        except ValidationError:
            continue
        yield f"params_model.{name} can be changed, the model must be frozen"


def construction(trial: Trial) -> Iterable[str]:
    """`cls(params)` does no work."""
    seconds = []
    for _ in range(3):
        start = time.perf_counter()
        trial.instance()
        seconds.append(time.perf_counter() - start)
    if min(seconds) > _CONSTRUCTION_S:
        yield (
            f"__init__ works for {1000 * min(seconds):.0f} ms, at most {1000 * _CONSTRUCTION_S:.0f} ms; the method is for work"
        )


def imports(trial: Trial) -> Iterable[str]:
    """The module of a plug-in knows of Gripwright what is public."""
    module = sys.modules[trial.plugin.__module__]
    for node in ast.walk(ast.parse(inspect.getsource(module))):
        names = [node.module or ""] if isinstance(node, ast.ImportFrom) and node.level == 0 else []
        names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        for name in names:
            root, _, rest = name.partition(".")
            if root == "gripwright" and rest.partition(".")[0] not in _PUBLIC:
                yield f"{module.__name__} imports {name}; of gripwright only {', '.join(sorted(_PUBLIC))} are public"


def instance_pickles(trial: Trial) -> Iterable[str]:
    """Instances go to other processes."""
    try:
        pickle.loads(pickle.dumps(trial.instance()))
    except Exception as error:  # noqa: BLE001 - a plug-in's own code
        yield f"an instance cannot be pickled: {type(error).__name__}: {error}"


def answers(trial: Trial) -> Iterable[str]:
    """Every sample gets an answer; what raises is named by the runs themselves."""
    return (f"{run.case.name}: {run.case.method} returns None" for run in trial.runs if run.answer is None)


def arguments_unchanged(trial: Trial) -> Iterable[str]:
    """What is handed in is the same afterwards."""
    for run in trial.runs:
        place = first_difference(run.arguments_before, run.arguments_after)
        if place is not None:
            yield f"{run.case.name}: {run.case.method} changes its argument {place}"


def deterministic(trial: Trial) -> Iterable[str]:
    """The same input and seed give the same answer, whichever instance is asked."""
    for run in trial.runs:
        if run.arguments_before != run.arguments_after:
            continue  # the second run was of another input
        place = first_difference(run.answer_leaves, run.again_leaves)
        if place is not None:
            yield f"{run.case.name}: two runs of the same input and seed differ at {place}; randomness comes from ctx.rng alone"


def answers_pickle(trial: Trial) -> Iterable[str]:
    """Answers go to other processes, and are the same there."""
    for run in trial.runs:
        try:
            copy = pickle.loads(pickle.dumps(run.answer))
        except Exception as error:  # noqa: BLE001 - a plug-in's own code
            yield f"{run.case.name}: the answer cannot be pickled: {type(error).__name__}: {error}"
            continue
        place = first_difference(run.answer_leaves, leaves(copy))
        if place is not None:
            yield f"{run.case.name}: the answer is another after pickling, at {place}"


def memory(trial: Trial) -> Iterable[str]:
    """What a call takes it gives back: of each method the first case is asked again and again."""
    for case in {case.method: case for case in reversed(trial.cases)}.values():
        kept = min(_kept_mb(trial, case, collect=False))
        if kept > _KEPT_MB:
            kept = min(_kept_mb(trial, case, collect=True))  # what goes in circles is given back late
        if kept > _KEPT_MB:
            yield f"{case.name}: each of {_CALLS} calls of {case.method} keeps {kept:.1f} MB or more, at most {_KEPT_MB:g} MB"


def _kept_mb(trial: Trial, case: Case, *, collect: bool) -> list[float]:
    """By how much the memory of this process grows with each of some calls; caches and threads are filled and started once."""
    kept = []
    for _ in range(_CALLS):
        before = _taken_mb()
        case.ask(trial.instance(), fake_context(seed=7))
        if collect:
            gc.collect()
        kept.append(_taken_mb() - before)
    return kept


def _taken_mb() -> float:
    """Private memory of this process, touched or not."""
    with open("/proc/self/status", encoding="ascii") as status:
        (kilobytes,) = (line.split()[1] for line in status if line.startswith("VmData:"))
    return int(kilobytes) / 1024.0


def cancellation(trial: Trial) -> Iterable[str]:
    """A stop that arrives through `ctx.progress` comes out of the method."""
    asked = []

    def stop(fraction: float, message: str) -> None:
        asked.append((fraction, message))
        raise Cancelled("stopped by the caller")

    for case in trial.cases[:1]:
        try:
            case.ask(trial.instance(), fake_context(seed=7, progress=stop))
        except Cancelled:
            continue
        if asked:
            yield f"{case.name}: {case.method} swallows the cancellation that ctx.progress raises"


GATES = (
    Check("contract", "class variables and arguments are as the Protocol says", contract),
    Check("samples", "own samples are components in segments, or primitives", samples),
    Check("answers", "every sample gets an answer in time, an expected no as a Rejection", answers),
)
"""What must hold before anything else can be checked."""

CHECKS = (
    Check("parameters", "the parameters are frozen, described, and survive JSON", parameters),
    Check("construction", "cls(params) does no work", construction),
    Check("imports", "of Gripwright only what is public is imported", imports),
    Check("instance pickles", "an instance can be pickled", instance_pickles),
    Check("arguments unchanged", "no argument is changed", arguments_unchanged),
    Check("deterministic", "the same input and seed give the same answer", deterministic),
    Check("answers pickle", "answers can be pickled", answers_pickle),
    Check("memory", "what a call takes it gives back", memory),
    Check("cancellation", "a cancellation is let through", cancellation),
)
