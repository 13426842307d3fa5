import threading
import time

import psutil
import pytest
from fake_calculation import executed

from gripwright.design.plan import plan_of
from gripwright.domain.errors import Cancelled, InvalidPlan, PluginFailure
from gripwright.jobs.child import Limits, Refused
from gripwright.jobs.engine import StepFailure
from gripwright.jobs.local import LocalRunner
from gripwright.jobs.steps import Workshop
from plugin_factory import FAKE_OPTIONS


def test_results_come_in_order_and_feed_later_stages(workshop, plan, log):
    runner = LocalRunner(workshop, plan)

    firsts = runner.map("first", [{"log": log, "name": str(i), "values": [i]} for i in range(4)])
    (second,) = runner.map("second", [{"log": log, "name": "sum", "values": [{"ref": ref} for ref in firsts]}])

    assert [runner.get(ref) for ref in firsts] == [0, 1, 2, 3]
    assert runner.get(second) == 6


def test_a_stored_step_is_not_run_again(workshop, plan, log):
    LocalRunner(workshop, plan).map("first", [{"log": log, "name": "a", "values": [1]}])
    LocalRunner(workshop, plan).map("first", [{"log": log, "name": "a", "values": [1]}, {"log": log, "name": "a", "values": [1]}])

    assert executed(log).count("begin:a") == 1


def test_a_damaged_result_is_computed_again(workshop, plan, log):
    (ref,) = LocalRunner(workshop, plan).map("first", [{"log": log, "name": "a", "values": [1]}])
    path = workshop.data_dir / "steps" / ref[:2] / ref
    path.write_bytes(path.read_bytes()[:-1])

    LocalRunner(workshop, plan).map("first", [{"log": log, "name": "a", "values": [1]}])

    assert executed(log).count("begin:a") == 2


@pytest.mark.parametrize(("change", "again"), [({"seed": 7}, True), ({"margin": 5.0}, False), ({"fake.rays": 3}, False)])
def test_a_step_is_computed_again_only_for_options_that_it_declares(workshop, plan, log, change, again):
    LocalRunner(workshop, plan).map("first", [{"log": log, "name": "a"}])

    LocalRunner(workshop, plan_of({**FAKE_OPTIONS, **change})).map("first", [{"log": log, "name": "a"}])

    assert executed(log).count("begin:a") == (2 if again else 1)


def test_a_step_is_computed_again_for_parameters_of_the_plugins_it_uses(workshop, plan, log):
    LocalRunner(workshop, plan).map("second", [{"log": log, "name": "a"}])

    LocalRunner(workshop, plan_of({**FAKE_OPTIONS, "fake.rays": 3})).map("second", [{"log": log, "name": "a"}])

    assert executed(log).count("begin:a") == 2


def test_a_stage_cannot_read_an_option_that_it_does_not_declare(workshop, plan, log):
    with pytest.raises(StepFailure, match="safety_factor"):
        LocalRunner(workshop, plan).map("first", [{"log": log, "name": "a", "act": "undeclared"}])


@pytest.mark.parametrize(
    ("act", "message"),
    [
        ("segfault", "crashed with SIGSEGV"),
        ("memory", "needs more than 1024 MB"),
        ("raise", "raised ZeroDivisionError"),
    ],
)
def test_a_step_that_breaks_is_a_failure_of_its_stage_alone(workshop, plan, log, act, message):
    runner = LocalRunner(workshop, plan)

    with pytest.raises(StepFailure, match=message) as failure:
        runner.map("first", [{"log": log, "name": "a", "act": act}])

    assert failure.value.context["stage"] == "first"
    assert runner.get(runner.map("first", [{"log": log, "name": "b", "values": [1]}])[0]) == 1


def test_a_step_that_hangs_is_ended_at_its_deadline(workshop, plan, log):
    hasty = Workshop(
        data_dir=workshop.data_dir,
        plugins_allow=workshop.plugins_allow,
        limits=Limits(timeout_s=1.0),
        stages_at=workshop.stages_at,
    )
    start = time.monotonic()

    with pytest.raises(StepFailure, match="took more than 1 s"):
        LocalRunner(hasty, plan).map("first", [{"log": log, "name": "a", "act": "hang"}])

    assert time.monotonic() - start < 5.0


def test_a_plugin_that_raises_is_named(workshop, plan, log):
    with pytest.raises(Refused, match="optimizer/fake raised ValueError: solves nothing") as failure:
        LocalRunner(workshop, plan).map("second", [{"log": log, "name": "a", "act": "plugin"}])

    assert failure.value.code == PluginFailure.code
    assert failure.value.context["plugin"] == "optimizer/fake"


def test_a_plan_with_faults_is_refused_with_all_of_them(workshop):
    plan = plan_of({**FAKE_OPTIONS, "segmenter": "magic", "fake.rays": 0})

    with pytest.raises(Refused) as refused:
        LocalRunner(workshop, plan)

    assert refused.value.code == InvalidPlan.code
    assert {fault.pointer for fault in refused.value.faults} == {"/options/segmenter", "/options/fake.rays"}


def test_cancelling_ends_running_steps_within_a_second(workshop, plan, log):
    stop = threading.Event()
    runner = LocalRunner(workshop, plan, cancelled=stop.is_set)
    timer = threading.Timer(1.0, stop.set)
    timer.start()
    start = time.monotonic()

    with pytest.raises(Cancelled):
        runner.map("first", [{"log": log, "name": "a", "act": "hang"}, {"log": log, "name": "b", "act": "hang"}])

    assert time.monotonic() - start < 2.0


def test_what_a_step_started_ends_with_it(workshop, plan, log):
    stop = threading.Event()
    runner = LocalRunner(
        workshop, plan, cancelled=lambda: any(line.startswith("pid:") for line in executed(log)) or stop.is_set()
    )

    with pytest.raises(Cancelled):
        runner.map("first", [{"log": log, "name": "a", "act": "grandchild"}])

    pid = next(int(line.removeprefix("pid:")) for line in executed(log) if line.startswith("pid:"))
    time.sleep(0.2)
    assert not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE


def test_the_first_failure_stops_the_other_steps(workshop, plan, log):
    start = time.monotonic()

    with pytest.raises(StepFailure):
        LocalRunner(workshop, plan).map(
            "first", [{"log": log, "name": "a", "act": "hang"}, {"log": log, "name": "b", "act": "segfault"}]
        )

    assert time.monotonic() - start < 8.0


def test_progress_grows_and_is_told_at_once(workshop, plan, log):
    told = []
    runner = LocalRunner(workshop, plan, on_progress=lambda fraction, stage, message: told.append((fraction, stage, message)))

    runner.map("first", [{"log": log, "name": "a"}])
    runner.map("second", [{"log": log, "name": "b"}])

    fractions = [fraction for fraction, _, _ in told]
    assert fractions == sorted(fractions)
    assert told[0] == (pytest.approx(1 / 6), "first", "add a")
