import pytest

from gripwright.traces import TracePlace, place_of

TRACE, SPAN = "4bf92f3577b34da6a3ce929d0e0e4736", "00f067aa0ba902b7"


def test_the_answer_names_the_trace_of_its_caller(client):
    answer = client.get("/health/live", headers={"traceparent": f"00-{TRACE}-{SPAN}-01"})

    assert answer.headers["X-Request-ID"] == TRACE


def test_an_id_of_the_callers_own_goes_before(client):
    answer = client.get("/health/live", headers={"traceparent": f"00-{TRACE}-{SPAN}-01", "X-Request-ID": "mine"})

    assert answer.headers["X-Request-ID"] == "mine"


@pytest.mark.parametrize(("flags", "is_sampled"), [("00", False), ("01", True), ("02", False), ("03", True)])
def test_a_trace_is_read_with_its_flag(flags, is_sampled):
    assert place_of(f"00-{TRACE}-{SPAN}-{flags}") == TracePlace(
        trace_id=TRACE, span_id=SPAN, parent_id=None, is_sampled=is_sampled
    )


def test_a_later_version_may_say_more():
    assert place_of(f"01-{TRACE}-{SPAN}-01-more") == place_of(f"00-{TRACE}-{SPAN}-01")


@pytest.mark.parametrize(
    "header",
    [
        *("", "00", f"00-{TRACE}-{SPAN}", f"00-{TRACE}-{SPAN}-01-more", f"ff-{TRACE}-{SPAN}-01", f"01-{TRACE}-{SPAN}-01more"),
        *(f"00-{'0' * 32}-{SPAN}-01", f"00-{TRACE}-{'0' * 16}-01", f"00-{TRACE.upper()}-{SPAN}-01", f"0g-{TRACE}-{SPAN}-01"),
        *(f"00-{TRACE[1:]}-{SPAN}-01", f"00-{TRACE}-{SPAN}-1", f"00-{TRACE}-{SPAN}-01\x00", "é" * 55),
    ],
)
def test_what_is_no_trace_is_ignored(client, header):
    answer = client.get("/health/live", headers={"traceparent": header.encode("latin-1")})

    assert place_of(header) is None
    assert answer.status_code == 200
    assert len(answer.headers["X-Request-ID"]) == 32
    assert answer.headers["X-Request-ID"] != TRACE
