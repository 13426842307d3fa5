import time

import pytest
from fake_calculation import executed
from service import make_service

from gripwright.store.step_stats import StepStatRepository


@pytest.fixture
def service(tmp_path, monkeypatch):
    """A service without a worker."""
    service = make_service(tmp_path, monkeypatch)
    yield service
    service.stop()


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    """A service whose one worker must survive all tests of this module."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        service = make_service(tmp_path_factory.mktemp("served"), monkeypatch)
        worker = service.start_worker()
    service.wait(service.request_design("warm-up"))
    yield service
    assert worker.poll() is None
    service.stop()


def test_a_design_runs_to_its_end_with_its_files_and_events(served):
    design_id = served.request_design("a1 b1 c1")

    job = served.wait(design_id)

    assert job.status == "succeeded", job.problem
    assert served.design(design_id).outcome == "complete"
    fractions = [event.data["progress"]["fraction"] for event in served.events(design_id)]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0


def test_steps_are_counted_and_timed_by_how_they_ended(served):
    for words in ("m1 m2", "m1 m2", "m3:segfault"):
        served.wait(served.request_design(words))

    def counted(stage, outcome):
        with served.database.read_sessions() as session:
            return [ended for kind, ended in StepStatRepository(session).all() if kind[:2] == (stage, outcome)]

    (crashed,) = served.wait_for(lambda: counted("first", "step-failure"), 10)
    computed = counted("first", "computed")[0]
    assert crashed.steps == 1
    assert computed.seconds > 0
    assert sum(ended.steps for ended in counted("first", "stored")) == 2
    assert sum(ended.steps for ended in counted("design", "step-failure")) == 1


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
def test_a_step_that_breaks_fails_its_design_and_no_other(served, act, words):
    broken, sound = served.request_design(f"{act}-a {act}-b:{act}"), served.request_design(f"{act}-x {act}-y")

    assert served.wait(broken).status == "failed"
    assert served.wait(sound).status == "succeeded"

    problem = served.job(broken).problem
    assert words in problem["detail"]
    assert problem["stage"] == "first"
    assert "Traceback" not in str(problem)


def test_a_running_design_is_cancelled_within_a_second(served):
    design_id = served.request_design("a2 b2:hang")
    served.wait_for_step("begin:b2")

    served.change(design_id, "cancel")
    start = time.monotonic()
    job = served.wait(design_id)

    assert job.status == "cancelled"
    assert time.monotonic() - start < 1.0
    assert "end:b2" not in executed(served.log)


def test_a_retry_continues_from_the_failed_step(served):
    design_id = served.request_design("a3 b3:once")
    assert served.wait(design_id).status == "failed"

    served.change(design_id, "retry")
    job = served.wait(design_id)

    assert (job.status, job.attempt) == ("succeeded", 2)
    assert executed(served.log).count("begin:a3") == 1
    assert executed(served.log).count("begin:b3") == 2


def test_a_design_of_stored_steps_alone_runs_none(served):
    served.wait(served.request_design("a4 b4"))
    before = executed(served.log)

    start = time.monotonic()
    job = served.wait(served.request_design("a4 b4"))

    assert job.status == "succeeded"
    assert executed(served.log) == before
    assert time.monotonic() - start < 2.0


def test_progress_is_visible_within_a_second_of_starting(served):
    design_id = served.request_design("a5:wait")

    served.wait(design_id, status=("running",))
    start = time.monotonic()
    served.wait_for(lambda: served.job(design_id).stage)

    assert time.monotonic() - start < 1.0
    served.let_go("a5")
    served.wait(design_id)


def test_a_queued_design_waits_for_a_worker_and_no_longer(service):
    design_id = service.request_design("a")
    assert service.job(design_id).status == "queued"

    service.change(design_id, "cancel")
    service.start_worker()
    other = service.request_design("b")

    assert service.wait(other).status == "succeeded"
    assert service.job(design_id).status == "cancelled"
    assert executed(service.log).count("begin:a") == 0


def test_an_urgent_design_overtakes_those_that_wait(service):
    usual = [service.request_design(f"usual-{number}") for number in range(8)]
    urgent = service.request_design("urgent", priority=9)

    service.start_worker()

    for design_id in [*usual, urgent]:
        service.wait(design_id)
    begun = [line.removeprefix("begin:") for line in executed(service.log) if line.startswith("begin:")]
    assert begun.index("urgent") < 4  # as many are begun at once, and their steps race
    started = {design_id: service.job(design_id).started_at for design_id in [*usual, urgent]}
    assert min(started, key=started.get) == urgent


@pytest.mark.parametrize("words", ["late:hang", "late-and-waiting"])
def test_a_design_ends_at_its_deadline_wherever_it_is(served, words):
    crowd = [served.request_design(f"{words}-{number}:wait", priority=9) for number in range(4)] if "waiting" in words else []
    for number in range(len(crowd)):
        served.wait(crowd[number], status=("running",))
    design_id = served.request_design(words, deadline_s=2.0)

    job = served.wait(design_id)

    assert (job.status, job.problem["code"]) == ("failed", "deadline-exceeded")
    late_s = (job.finished_at - job.deadline_at).total_seconds()
    assert 0.0 <= late_s < (2.5 if crowd else 1.0)
    for number in range(len(crowd)):
        served.let_go(f"{words}-{number}")
    for waiting in crowd:
        assert served.wait(waiting).status == "succeeded"


def test_a_step_that_crashed_is_not_tried_for_another_design_until_somebody_asks(served):
    designs = [served.request_design(f"poison:segfault {name}") for name in ("a6", "b6")]
    problems = {served.wait(design_id).problem["code"]: design_id for design_id in designs}  # they run side by side

    assert problems.keys() == {"step-failure", "quarantined"}
    second = problems["quarantined"]
    assert "crashed with SIGSEGV, once by now" in served.job(second).problem["detail"]
    assert executed(served.log).count("begin:poison") == 1

    served.change(second, "retry")
    assert served.wait(second).problem["code"] == "step-failure"
    assert executed(served.log).count("begin:poison") == 2


def test_a_step_whose_process_was_killed_is_tried_again_a_while_later(served):
    design_id = served.request_design("a7 b7:killed-once")

    job = served.wait(design_id)

    assert (job.status, job.attempt, job.recoveries) == ("succeeded", 2, 1)
    assert [executed(served.log).count(f"begin:{name}") for name in ("a7", "b7")] == [1, 2]
    waits = [event.data for event in served.events(design_id) if event.data["not_before"] is not None]
    assert [wait["status"] for wait in waits] == ["queued"]
    assert "SIGKILL" in waits[0]["progress"]["message"]
