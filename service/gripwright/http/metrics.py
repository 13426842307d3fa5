"""Figures of the service for Prometheus: those of this process, and those of all workers, which stand in the database."""

import platform
import shutil
from collections import defaultdict
from collections.abc import Iterator, Sequence
from datetime import datetime
from itertools import accumulate
from pathlib import Path

from prometheus_client import (
    CollectorRegistry,
    Counter,
    Histogram,
    Info,
    ProcessCollector,
    disable_created_metrics,
    generate_latest,
)
from prometheus_client.metrics_core import CounterMetricFamily, GaugeMetricFamily, HistogramMetricFamily, Metric
from prometheus_client.registry import Collector
from sqlalchemy.orm import Session

import gripwright
from gripwright.store.designs import JobRepository
from gripwright.store.models import DELIVERY_STATUSES, JOB_STATUSES
from gripwright.store.step_stats import BOUNDS_S, COMPUTED, DESIGN, STORED, Ended, Kind, StepStatRepository
from gripwright.store.webhooks import WebhookRepository

disable_created_metrics()  # type: ignore[no-untyped-call]  # a second series for each, which no query needs

_METHODS = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})  # any other word is counted as one
_REQUEST_BOUNDS_S = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0)


class Metrics:
    """What this process has seen; the rest is read when it is asked for."""

    def __init__(self) -> None:
        self._registry = CollectorRegistry()
        ProcessCollector(registry=self._registry)
        about = Info("gripwright_build", "What runs here.", registry=self._registry)
        about.info({"version": gripwright.__version__, "python": platform.python_version()})
        self._requests = Counter(
            "gripwright_http_requests_total", "Answered requests.", ["method", "route", "status"], registry=self._registry
        )
        self._durations = Histogram(
            "gripwright_http_request_duration_seconds",
            "From the first byte of a request's head to the last of its answer.",
            ["method", "route"],
            buckets=_REQUEST_BOUNDS_S,
            registry=self._registry,
        )

    def request_answered(self, method: str, route: str, status: int, seconds: float) -> None:
        """A request was answered; `route` is the template of its path, so that ids make no series."""
        method = method if method in _METHODS else "other"
        self._requests.labels(method, route, status).inc()
        self._durations.labels(method, route).observe(seconds)

    def text(self, session: Session, data_dir: Path, now: datetime) -> bytes:
        """All of it in Prometheus' text format."""
        stored = CollectorRegistry()
        stored.register(_Stored(session, data_dir, now))
        return generate_latest(stored) + generate_latest(self._registry)


class _Stored(Collector):
    """What the database says, of all processes on all hosts."""

    def __init__(self, session: Session, data_dir: Path, now: datetime) -> None:
        self._session, self._data_dir, self._now = session, data_dir, now

    def collect(self) -> Iterator[Metric]:
        yield from self._jobs()
        yield from self._steps(StepStatRepository(self._session).all())
        yield from self._webhooks()
        free = GaugeMetricFamily("gripwright_storage_free_bytes", "Free space where files are stored.")
        free.add_metric([], shutil.disk_usage(self._data_dir).free)
        yield free

    def _jobs(self) -> Iterator[Metric]:
        jobs = JobRepository(self._session)
        counts, oldest = jobs.counts(), jobs.oldest_queued()
        by_status = GaugeMetricFamily("gripwright_jobs", "Jobs by status.", labels=["status"])
        for status in JOB_STATUSES:
            by_status.add_metric([status], counts.get(status, 0))
        yield by_status
        age = GaugeMetricFamily("gripwright_oldest_queued_seconds", "Age of the job that has waited longest, 0 where none waits.")
        age.add_metric([], 0.0 if oldest is None else (self._now - oldest).total_seconds())
        yield age

    def _steps(self, counts: Sequence[tuple[Kind, Ended]]) -> Iterator[Metric]:
        steps = [(kind, ended) for kind, ended in counts if kind.stage != DESIGN]
        designs = [(kind, ended) for kind, ended in counts if kind.stage == DESIGN]
        yield _durations(
            "gripwright_step_duration_seconds",
            "Steps that were computed, until their result was stored.",
            "stage",
            [(kind.stage, kind.bucket, ended) for kind, ended in steps if kind.outcome == COMPUTED],
        )
        yield _durations(
            "gripwright_design_duration_seconds",
            "Designs that ended, from their start.",
            "outcome",
            [(kind.outcome, kind.bucket, ended) for kind, ended in designs],
        )
        yield _count("gripwright_step_cache_hits", "Steps whose result was stored.", ["stage"], _by_stage(steps, {STORED}))
        computed = _by_stage(steps, {COMPUTED})
        yield _count("gripwright_step_cache_misses", "Steps that were computed.", ["stage"], computed)
        failed = [((kind.stage, kind.outcome), ended.steps) for kind, ended in steps if kind.outcome not in (COMPUTED, STORED)]
        yield _count("gripwright_step_failures", "Steps that brought no result.", ["stage", "code"], failed)

    def _webhooks(self) -> Iterator[Metric]:
        webhooks = WebhookRepository(self._session)
        counts = webhooks.delivery_counts()
        deliveries = GaugeMetricFamily("gripwright_webhook_deliveries", "Messages that are kept, by status.", labels=["status"])
        for status in DELIVERY_STATUSES:
            deliveries.add_metric([status], counts.get(status, 0))
        yield deliveries
        disabled = GaugeMetricFamily("gripwright_webhooks_disabled", "Webhooks that nothing is sent to.")
        disabled.add_metric([], webhooks.count_disabled())
        yield disabled


def _by_stage(counts: Sequence[tuple[Kind, Ended]], outcomes: set[str]) -> list[tuple[tuple[str, ...], int]]:
    return [((kind.stage,), ended.steps) for kind, ended in counts if kind.outcome in outcomes]


def _count(name: str, what: str, labels: list[str], counts: Sequence[tuple[tuple[str, ...], int]]) -> CounterMetricFamily:
    """A counter, of counts that may name the same labels several times."""
    family, sums = CounterMetricFamily(name, what, labels=labels), defaultdict[tuple[str, ...], int](int)
    for values, steps in counts:
        sums[values] += steps
    for values, steps in sums.items():
        family.add_metric(list(values), steps)
    return family


def _durations(name: str, what: str, label: str, counts: Sequence[tuple[str, int, Ended]]) -> HistogramMetricFamily:
    """A histogram, of (value of the label, bucket, what is in it)."""
    family = HistogramMetricFamily(name, what, labels=[label])
    bounds = [*map(str, BOUNDS_S), "+Inf"]
    in_buckets = defaultdict[str, list[int]](lambda: [0] * len(bounds))
    seconds = defaultdict[str, float](float)
    for value, bucket, ended in counts:
        in_buckets[value][bucket] += ended.steps
        seconds[value] += ended.seconds
    for value, steps in in_buckets.items():
        family.add_metric([value], list(zip(bounds, accumulate(steps), strict=True)), seconds[value])
    return family
