"""A plug-in tried on sample cases: every case twice, with all that the checks need to compare."""

import inspect
import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from gripwright.domain.errors import Rejection
from gripwright.domain.shape import Primitive
from gripwright.plugin_api import RunContext
from gripwright.plugin_api.stored import unnamed_class
from gripwright.testing.leaves import leaves
from gripwright.testing.samples import Sample, fake_context, sample_components
from gripwright.testing.time_limit import TimeUp, time_limit


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Case:
    """One call of one method, without the context."""

    name: str
    method: str
    arguments: Mapping[str, Any]

    def ask(self, plugin: Any, ctx: RunContext) -> Any:
        """What the plug-in answers."""
        method = getattr(plugin, self.method)
        takes_context = "ctx" in inspect.signature(method).parameters
        return method(**self.arguments, **({"ctx": ctx} if takes_context else {}))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Run:
    """A case asked twice, of two instances, and the digests of what went in and came out."""

    case: Case
    answer: Any
    answer_leaves: dict[str, bytes]
    again_leaves: dict[str, bytes]
    arguments_before: dict[str, bytes]
    arguments_after: dict[str, bytes]


OWN_SAMPLES = "as `samples` of its PluginEntry, and of check_plugin or parametrize_with_checks"
"""Where an author's own samples are taken from."""


_NUMBERS = re.compile(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?")


class DidNotAnswer(Exception):
    """A case that ended with an exception."""


class Trial:
    """A plug-in class and its runs; they are made when they are first asked for.

    `samples` are the author's own, `primitives` the classes that manifests name, None where there is no manifest to ask.
    """

    def __init__(
        self,
        plugin: Any,
        kind: str,
        cases_of: "Callable[[Trial], Sequence[Case]]",
        samples: Sequence[Any] = (),
        primitives: Collection[type] | None = None,
    ) -> None:
        self.plugin, self.kind, self._cases_of, self.samples, self.primitives = plugin, kind, cases_of, samples, primitives

    @property
    def components(self) -> tuple[Sample, ...]:
        """The built-in sample components, and the author's own."""
        return (*sample_components(), *(sample for sample in self.samples if isinstance(sample, Sample)))

    @property
    def own_primitives(self) -> tuple[Primitive, ...]:
        """The primitives among the author's samples."""
        return tuple(sample for sample in self.samples if isinstance(sample, Primitive))

    def instance(self) -> Any:
        """One with default parameters."""
        return self.plugin(self.plugin.params_model())

    @cached_property
    def cases(self) -> tuple[Case, ...]:
        """What a plug-in of this kind is asked."""
        return tuple(self._cases_of(self))

    @cached_property
    def runs(self) -> tuple[Run, ...]:
        """Every case asked twice; DidNotAnswer names the first that raises."""
        return tuple(self._run(case) for case in self.cases)

    def answers(self) -> Iterable[tuple[Case, Any]]:
        """Every case with its answer, where that is no Rejection."""
        return ((run.case, run.answer) for run in self.runs if not isinstance(run.answer, Rejection))

    @property
    def own_runs(self) -> tuple[Run, ...]:
        """The runs of the author's own samples."""
        own = {id(sample.component if isinstance(sample, Sample) else sample) for sample in self.samples}
        return tuple(run for run in self.runs if any(id(value) in own for value in run.case.arguments.values()))

    def unnamed(self, primitives: Iterable[Any]) -> list[str]:
        """A sentence for each class of primitives that results cannot hold, since no manifest names it."""
        if self.primitives is None:
            return []
        missing = {cls for primitive in primitives if (cls := unnamed_class(primitive, self.primitives)) is not None}
        return [
            f"{cls.__name__}, which its PluginEntry.primitives does not name: "
            f'add "{cls.__module__}:{cls.__qualname__}" to it, results cannot be stored without'
            for cls in sorted(missing, key=lambda cls: cls.__qualname__)
        ]

    def refused_own(self, asked: str, answer: str) -> str:
        """A sentence where all of the author's own samples are refused; empty: one is answered, or there are none."""
        own = [(run.case.name, run.answer) for run in self.own_runs]
        if not own or not all(isinstance(said, Rejection) for _, said in own):
            return ""
        name, rejection = own[0]
        counted = (
            f"{len(own)} {asked} of your own samples"
            if any(self.answers())
            else f"{len(self.runs)} {asked}, {len(own)} of them of your own samples,"
        )
        return f"none of {counted} is answered with {answer}; {name!r} got {rejection.code}: {rejection.detail}"

    def _run(self, case: Case) -> Run:
        before = leaves(case.arguments)
        try:
            answer, again = (case.ask(self.instance(), fake_context(seed=7)) for _ in range(2))
        except (Exception, SystemExit) as error:
            raise DidNotAnswer(
                f"{case.name}: {case.method} raises {type(error).__name__}: {error}; "
                'an expected "no" is returned as a Rejection, an exception is a defect'
            ) from error
        return Run(
            case=case,
            answer=answer,
            answer_leaves=leaves(answer),
            again_leaves=leaves(again),
            arguments_before=before,
            arguments_after=leaves(case.arguments),
        )


@dataclass(frozen=True, slots=True)
class Finding:
    """A check that a plug-in does not pass, and what is wrong."""

    check: str
    detail: str

    def __str__(self) -> str:
        return f"{self.check}: {self.detail}"


@dataclass(frozen=True, slots=True)
class Check:
    """One rule of the contract; `faults` yields a sentence for every way in which a trial breaks it."""

    name: str
    rule: str
    faults: Callable[[Trial], Iterable[str]]

    def findings(self, trial: Trial, time_limit_s: float) -> list[Finding]:
        """What is wrong, one finding a fault; an exception or an endless run is one too."""
        try:
            with time_limit(time_limit_s):
                details = list(self.faults(trial))
        except TimeUp:
            details = [f"takes longer than {time_limit_s:g} s on the samples of {trial.kind} plug-ins"]
        except DidNotAnswer as error:
            details = [str(error)]
        except Exception as error:  # noqa: BLE001 - a plug-in's own code, or its answer's
            details = [f"cannot be checked, it raises {type(error).__name__}: {error}"]
        return [Finding(self.name, detail) for detail in _each_once(details)]


def _each_once(details: Sequence[str]) -> Iterable[str]:
    """What is wrong with several samples alike, but for numbers, is told of the first: "sample: what is wrong"."""
    alike: dict[str, list[str]] = {}
    for detail in details:
        sample, _, fault = detail.partition(": ")
        alike.setdefault(_NUMBERS.sub("0", fault) or sample, []).append(detail)
    return (f"{first} (and {len(more)} more like it)" if more else first for first, *more in alike.values())


def is_vectors(value: Any, *, unit: bool = False) -> bool:
    """Whether a value is a finite array (k, 3), of unit vectors where asked."""
    if not (isinstance(value, np.ndarray) and value.ndim == 2 and value.shape[1] == 3 and np.isfinite(value).all()):
        return False
    return not unit or bool(np.allclose(np.linalg.norm(value, axis=1), 1.0, atol=1e-6))


def is_length(value: Any) -> bool:
    """Whether a value is a finite number above zero."""
    return isinstance(value, int | float) and not isinstance(value, bool) and bool(np.isfinite(value)) and value > 0
