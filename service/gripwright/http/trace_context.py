"""Which trace a request belongs to (W3C Trace Context): the caller's, or a new one."""

import re
import secrets
from dataclasses import dataclass

_TRACEPARENT = re.compile(r"(?!ff)[0-9a-f]{2}-(?!0{32})([0-9a-f]{32})-(?!0{16})([0-9a-f]{16})-([0-9a-f]{2})(?:-.*)?")
_SAMPLED = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class RequestTrace:
    """The place of a request in its trace."""

    trace_id: str  # 32 hex digits
    span_id: str  # of this request, 16 hex digits
    parent_id: str | None  # of the caller
    is_sampled: bool  # somebody records this trace

    @property
    def traceparent(self) -> str:
        """What is done for this request is a child of it."""
        return f"00-{self.trace_id}-{self.span_id}-{int(self.is_sampled):02x}"


def trace_of(traceparent: str) -> RequestTrace:
    """The trace that the header names, else a new one."""
    span_id = secrets.token_hex(8)
    found = _TRACEPARENT.fullmatch(traceparent.strip())
    if found is None or (traceparent.startswith("00") and len(traceparent.strip()) != 55):
        return RequestTrace(trace_id=secrets.token_hex(16), span_id=span_id, parent_id=None, is_sampled=True)
    is_sampled = bool(int(found[3], 16) & _SAMPLED)
    return RequestTrace(trace_id=found[1], span_id=span_id, parent_id=found[2], is_sampled=is_sampled)
