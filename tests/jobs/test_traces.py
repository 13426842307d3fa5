import subprocess
import sys

import pytest
from test_durability import make_service

from gripwright.store.models import JobRow
from otlp_collector import collecting

CALLER = f"00-{'ab' * 16}-{'cd' * 8}-01"


@pytest.fixture
def collector(monkeypatch):
    with collecting() as collector:
        monkeypatch.setenv("OTEL_EXPORTER_OTLP_ENDPOINT", collector.url)
        monkeypatch.setenv("OTEL_BSP_SCHEDULE_DELAY", "100")
        yield collector


def test_a_design_is_one_trace_from_the_request_to_the_child_of_each_step(tmp_path, monkeypatch, collector):
    service = make_service(tmp_path, monkeypatch)
    try:
        worker = service.start_worker()
        ids = [service.request_design(words) for words in ("a b", "a c:plugin")]
        with service.database.write_sessions.begin() as session:
            for design_id in ids:
                session.get_one(JobRow, design_id).traceparent = CALLER
        for design_id in ids:
            service.wait(design_id)
        service.wait_for(lambda: [span.name for span in collector.spans].count("design") == 2, 20)
        spans = list(collector.spans)
        assert worker.poll() is None
    finally:
        service.stop()

    assert {span.trace_id for span in spans} == {"ab" * 16}
    by_id = {span.span_id: span for span in spans}
    assert len(by_id) == len(spans)
    for span in spans:
        if span.name == "design":
            assert span.parent_id == "cd" * 8
        elif span.name.startswith("step"):
            assert by_id[span.parent_id].attributes["gripwright.design"] == span.attributes["gripwright.design"]
            assert by_id[span.parent_id].name == "design"
        else:
            step = by_id[span.parent_id]
            stage = step.attributes["gripwright.stage"]
            assert (span.name, step.name) == (f"compute {stage}", f"step {stage}")
            assert step.start_ns <= span.start_ns <= span.end_ns <= step.end_ns
            assert span.attributes["process.pid"] != worker.pid
    designs = {span.attributes["gripwright.design"]: span for span in spans if span.name == "design"}
    assert [designs[design_id].failed for design_id in ids] == [False, True]
    failed = [span for span in spans if span.failed and span.name.startswith("step")]
    assert [span.attributes["error.type"] for span in failed] == ["plugin-failure"]
    hits = [span for span in spans if span.name == "step first" and span.attributes["gripwright.cache_hit"]]
    assert {span.attributes["gripwright.design"] for span in hits} <= set(ids)
    second = next(span for span in spans if span.name == "step second")
    assert any(key.startswith("gripwright.plugin.optimizer/") for key in second.attributes)


def test_where_no_collector_is_named_nothing_of_the_library_is_loaded():
    script = (
        "import sys; from gripwright.traces import tracer_from_environment; assert tracer_from_environment() is None; "
        "import gripwright.jobs.worker, gripwright.http.app; "
        "print([name for name in sys.modules if name.startswith(('opentelemetry.sdk', 'opentelemetry.exporter'))])"
    )

    printed = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True).stdout

    assert printed.strip() == "[]"
