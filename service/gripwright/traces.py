"""Where work belongs in a trace (W3C Trace Context).

Ids are chosen here, not by a library: a design's span has the same id in every process, so that its steps can name it as
their parent though no process sees all of it.
"""

import hashlib
import os
import re
import secrets
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gripwright.tracer import Tracer

_TRACEPARENT = re.compile(r"(?!ff)([0-9a-f]{2})-(?!0{32})([0-9a-f]{32})-(?!0{16})([0-9a-f]{16})-([0-9a-f]{2})(-.*)?")
_SAMPLED = 1
_ENDPOINTS = ("OTEL_EXPORTER_OTLP_TRACES_ENDPOINT", "OTEL_EXPORTER_OTLP_ENDPOINT")


@dataclass(frozen=True, slots=True, kw_only=True)
class TracePlace:
    """The place of one span in its trace."""

    trace_id: str  # 32 hex digits
    span_id: str  # 16 hex digits
    parent_id: str | None
    is_sampled: bool  # whoever began the trace wants it recorded

    @property
    def traceparent(self) -> str:
        """The header that makes something a child of this span."""
        return f"00-{self.trace_id}-{self.span_id}-{int(self.is_sampled):02x}"

    def child(self, name: str | None = None) -> "TracePlace":
        """A place below this one; with a name it is the same each time."""
        named = None if name is None else hashlib.sha256(f"{self.trace_id}.{name}".encode()).hexdigest()[:16]
        return TracePlace(
            trace_id=self.trace_id, span_id=named or secrets.token_hex(8), parent_id=self.span_id, is_sampled=self.is_sampled
        )


def place_of(traceparent: str) -> TracePlace | None:
    """The span that the header names, None where it names none."""
    found = _TRACEPARENT.fullmatch(traceparent.strip())
    if found is None or (found[1] == "00" and found[5]):
        return None
    return TracePlace(trace_id=found[2], span_id=found[3], parent_id=None, is_sampled=bool(int(found[4], 16) & _SAMPLED))


def place_below(traceparent: str) -> TracePlace:
    """A new place in the trace that the header names, else in a new trace."""
    parent = place_of(traceparent)
    if parent is not None:
        return parent.child()
    return TracePlace(trace_id=secrets.token_hex(16), span_id=secrets.token_hex(8), parent_id=None, is_sampled=True)


def tracer_from_environment() -> "Tracer | None":
    """A tracer where OpenTelemetry's own variables name a collector, else None; only who sends spans pays for the library."""
    if not any(os.environ.get(name) for name in _ENDPOINTS):
        return None
    from gripwright.tracer import Tracer

    return Tracer()
