"""`traceparent` of a request (W3C Trace Context): which trace of the caller it belongs to."""

import re
from dataclasses import dataclass

_FORM = re.compile(r"([0-9a-f]{2})-([0-9a-f]{32})-([0-9a-f]{16})-([0-9a-f]{2})(-.*)?")
_NONE, _UNUSED_VERSION = "0", "ff"


@dataclass(frozen=True, slots=True, kw_only=True)
class TraceParent:
    """The caller's trace and span, 32 and 16 hexadecimal digits, and whether it records them."""

    trace_id: str
    span_id: str
    is_sampled: bool


def parse_traceparent(header: str) -> TraceParent | None:
    """The caller's trace; None where the header is not one: as the standard says it is then ignored."""
    form = _FORM.fullmatch(header.strip())
    if form is None:
        return None
    version, trace_id, span_id, flags, more = form.groups()
    is_of_first_version_with_more = version == "00" and more is not None
    if version == _UNUSED_VERSION or is_of_first_version_with_more or not trace_id.strip(_NONE) or not span_id.strip(_NONE):
        return None
    return TraceParent(trace_id=trace_id, span_id=span_id, is_sampled=bool(int(flags, 16) & 1))
