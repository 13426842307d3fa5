"""Spans that are over, told to an OpenTelemetry collector. Imported only where there is one."""

import os
import threading
from collections.abc import Mapping
from typing import Any

from opentelemetry import trace
from opentelemetry.context import Context
from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
from opentelemetry.sdk.resources import Resource
from opentelemetry.sdk.trace import TracerProvider
from opentelemetry.sdk.trace.export import BatchSpanProcessor
from opentelemetry.sdk.trace.id_generator import IdGenerator
from opentelemetry.sdk.trace.sampling import ALWAYS_ON, ParentBased

import gripwright
from gripwright.traces import TracePlace


class _ChosenIds(IdGenerator):
    """Gives out the ids of the place that is told next."""

    place: TracePlace

    def generate_span_id(self) -> int:
        return int(self.place.span_id, 16)

    def generate_trace_id(self) -> int:
        return int(self.place.trace_id, 16)


class Tracer:
    """Where the collector is and what it needs stands in OpenTelemetry's own variables. Any thread may use it."""

    def __init__(self) -> None:
        self._ids, self._lock = _ChosenIds(), threading.Lock()
        name = os.environ.get("OTEL_SERVICE_NAME", "gripwright")
        resource = Resource.create({"service.name": name, "service.version": gripwright.__version__})
        self._provider = TracerProvider(sampler=ParentBased(ALWAYS_ON), resource=resource, id_generator=self._ids)
        self._provider.add_span_processor(BatchSpanProcessor(OTLPSpanExporter()))
        self._tracer = self._provider.get_tracer("gripwright", gripwright.__version__)

    def tell(
        self,
        name: str,
        place: TracePlace,
        start_ns: int,
        end_ns: int,
        attributes: Mapping[str, Any],
        *,
        error: str | None = None,
        is_request: bool = False,
    ) -> None:
        """A span is over; `error` says how it failed. Nothing is sent of a trace that its beginner does not want recorded."""
        if not place.is_sampled:
            return
        kind = trace.SpanKind.SERVER if is_request else trace.SpanKind.INTERNAL
        with self._lock:
            self._ids.place = place
            span = self._tracer.start_span(name, _above(place), kind, attributes, start_time=start_ns)
        if error is not None:
            span.set_status(trace.Status(trace.StatusCode.ERROR, error))
        span.end(end_ns)

    def stop(self) -> None:
        """Send what waits."""
        self._provider.shutdown()


def _above(place: TracePlace) -> Context:
    """The context in which a span gets this parent, or none."""
    if place.parent_id is None:
        return trace.set_span_in_context(trace.INVALID_SPAN)
    flags = trace.TraceFlags(trace.TraceFlags.SAMPLED)
    parent = trace.SpanContext(int(place.trace_id, 16), int(place.parent_id, 16), is_remote=True, trace_flags=flags)
    return trace.set_span_in_context(trace.NonRecordingSpan(parent))
