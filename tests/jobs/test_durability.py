import time

import pytest
from fake_calculation import executed
from service import Service

from gripwright.settings import Settings


@pytest.fixture
def service(tmp_path, plugins, log, monkeypatch):
    monkeypatch.setenv("GRIPWRIGHT_DATA", str(tmp_path / "data"))
    monkeypatch.setenv("GRIPWRIGHT_PLUGINS_ALLOW", f'["{plugins}"]')
    service = Service(Settings(), log)
    yield service
    service.stop()


def test_a_design_runs_to_its_end_with_its_files_and_events(service):
    service.start_worker()
    design_id = service.request_design("a b c")

    job = service.wait(design_id)

    assert job.status == "succeeded", job.problem
    design = service.design(design_id)
    assert design.outcome == "complete"
    fractions = [event.data["fraction"] for event in service.events(design_id) if event.kind == "progress"]
    assert fractions == sorted(fractions)
    assert fractions


def test_a_worker_killed_in_any_stage_loses_nothing_and_repeats_no_finished_step(service):
    service.start_worker()
    design_id = service.request_design("a b:wait c second:wait")
    for waiting in ("b", "second"):
        service.wait_for_step(f"begin:{waiting}")
        service.kill_worker()
        service.let_go(waiting)
        service.start_worker()

    job = service.wait(design_id)

    assert job.status == "succeeded", job.problem
    steps = executed(service.log)
    assert [steps.count(f"end:{name}") for name in ("a", "b", "c", "second")] == [1, 1, 1, 1]
    assert steps.count("begin:a") == 1
    ends = [event for event in service.events(design_id) if event.data.get("status") == "succeeded"]
    assert len(ends) == 1


def test_another_worker_takes_over_what_a_dead_one_left(service):
    service.start_worker()
    design_id = service.request_design("a b:wait")
    service.wait_for_step("begin:b")
    second = service.start_worker()
    time.sleep(1.0)
    service.let_go("b")
    service.kill_worker(service.workers[0])

    job = service.wait(design_id)

    assert job.status == "succeeded", job.problem
    assert second.poll() is None


@pytest.mark.parametrize(("act", "words"), [("segfault", "SIGSEGV"), ("memory", "MB"), ("raise", "ZeroDivisionError")])
def test_a_step_that_breaks_fails_its_design_and_no_other(service, act, words):
    worker = service.start_worker()
    broken, sound = service.request_design(f"a b:{act}"), service.request_design("x y")

    assert service.wait(broken).status == "failed"
    assert service.wait(sound).status == "succeeded"

    problem = service.job(broken).problem
    assert words in problem["detail"]
    assert problem["stage"] == "first"
    assert "Traceback" not in str(problem)
    assert worker.poll() is None


def test_a_running_design_is_cancelled_within_a_second(service):
    service.start_worker()
    design_id = service.request_design("a b:hang")
    service.wait_for_step("begin:b")

    service.change(design_id, "cancel")
    start = time.monotonic()
    job = service.wait(design_id)

    assert job.status == "cancelled"
    assert time.monotonic() - start < 1.0
    assert "end:b" not in executed(service.log)


def test_a_retry_continues_from_the_failed_step(service):
    service.start_worker()
    design_id = service.request_design("a b:wait")
    service.wait_for_step("begin:b")
    service.change(design_id, "cancel")
    service.wait(design_id)
    service.let_go("b")

    service.change(design_id, "retry")
    job = service.wait(design_id)

    assert (job.status, job.attempt) == ("succeeded", 2)
    assert executed(service.log).count("begin:a") == 1
    assert executed(service.log).count("begin:b") == 2


def test_progress_is_visible_within_a_second_of_starting(service):
    service.start_worker()
    service.wait(service.request_design("warm-up"))
    design_id = service.request_design("a:wait")

    service.wait(design_id, status=("running",))
    start = time.monotonic()
    service.wait_for(lambda: service.job(design_id).stage)

    assert time.monotonic() - start < 1.0
    service.let_go("a")
    service.wait(design_id)
