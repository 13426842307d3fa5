"""Several workers on PostgreSQL: each of them may be killed or cut off at any moment."""

import signal
import time
from datetime import timedelta

import psutil
import pytest
from service import make_service

from gripwright.jobs.hosts import LOST, Lease, ProcessName, Watch
from gripwright.store.columns import utc_now
from gripwright.store.engines import Database
from gripwright.store.migrate import migrate
from gripwright.store.models import WorkerRow
from gripwright.store.workers import WorkerRegister, WorkerRepository

LEASE_S = 4.0


@pytest.fixture
def service(tmp_path, monkeypatch, postgresql, postgresql_server):
    jobs = postgresql_server.create_database(f"jobs_{tmp_path.name}")
    service = make_service(tmp_path, monkeypatch, DATABASE_URL=postgresql, JOBS_DATABASE_URL=jobs, WORKER_LEASE_S=str(LEASE_S))
    yield service
    service.stop()


@pytest.fixture
def register(tmp_path):
    database = Database(f"sqlite:///{tmp_path / 'test.db'}")
    migrate(database)
    yield WorkerRegister(database)
    database.dispose()


def standing(service):
    with service.database.read_sessions() as session:
        return {worker.row.pid: worker for worker in WorkerRepository(session).all()}


def test_what_a_cut_off_and_a_killed_worker_ran_is_continued_and_ends_once(service):
    cut_off, killed = service.start_worker(), service.start_worker()
    service.wait_for(lambda: len(standing(service)) == 2)
    design_ids = [service.request_design(f"a{number} b{number}:wait") for number in (1, 2)]
    for number in (1, 2):
        service.wait_for_step(f"begin:b{number}")
    third = service.start_worker()
    service.wait_for(lambda: third.pid in standing(service))

    cut_off.send_signal(signal.SIGSTOP)
    service.kill_worker(killed)
    for number in (1, 2):
        service.let_go(f"b{number}")
    ends = [service.wait(design_id) for design_id in design_ids]
    cut_off.send_signal(signal.SIGCONT)

    assert [job.status for job in ends] == ["succeeded", "succeeded"], [job.problem for job in ends]
    assert cut_off.wait(20) == LOST
    assert third.poll() is None
    assert set(standing(service)) == {third.pid}
    for design_id in design_ids:
        statuses = [event.data["status"] for event in service.events(design_id) if event.kind == "status"]
        assert statuses == ["queued", "running", "succeeded"]


def test_a_worker_that_is_told_to_end_leaves_its_work_to_others_at_once(service):
    first = service.start_worker()
    design_id = service.request_design("a b:wait")
    service.wait_for_step("begin:b")
    second = service.start_worker()
    service.wait_for(lambda: len(standing(service)) == 2)

    first.terminate()
    first.wait(20)
    service.let_go("b")

    assert service.wait(design_id).status == "succeeded"
    assert set(standing(service)) == {second.pid}


def test_a_killed_worker_leaves_no_process_behind_though_its_step_hangs(service):
    worker = service.start_worker()
    service.request_design("a:hang")
    service.wait_for_step("begin:a")
    family = psutil.Process(worker.pid).children(recursive=True)
    assert len(family) >= 2

    service.kill_worker(worker)

    service.wait_for(lambda: not [one for one in family if one.is_running() and one.status() != psutil.STATUS_ZOMBIE], 10.0)


def test_a_lease_that_is_struck_off_ends_its_worker_and_cannot_be_renewed(register):
    ended = []
    lease = Lease(register, 1.0, lambda: ended.append(time.monotonic()))
    lease.start()
    assert register.beat(lease.id, 3)

    register.remove(lease.id)
    deadline = time.monotonic() + 3.0
    while not ended and time.monotonic() < deadline:
        time.sleep(0.02)

    assert len(ended) == 1
    assert not register.beat(lease.id, 3)


def test_a_leap_of_the_clock_takes_no_worker_for_dead(register):
    lease = Lease(register, 60.0, lambda: None)
    lease.start()
    watch = Watch(register, lease_s=60.0)
    with register._database.write_sessions.begin() as session:
        session.get_one(WorkerRow, lease.id).heartbeat_at = utc_now() - timedelta(hours=5)

    assert watch.living() == {lease.id}
    lease.stop()
    assert watch.living() == set()


def test_a_silent_worker_is_struck_off_by_exactly_one_of_the_others(register):
    process = str(ProcessName(place="elsewhere", pid=1, started="1"))
    register.enter(id="far", host="far", process=process, pid=1, version="1")
    watches = [Watch(register, lease_s=0.2) for _ in range(3)]
    before = [watch.living() for watch in watches]

    time.sleep(0.3)
    seen = register.all()[0].heartbeat_at
    struck = [register.remove("far", seen) for _ in watches]

    assert before == [{"far"}] * 3
    assert struck == [True, False, False]
    assert [watch.living() for watch in watches] == [set()] * 3


def test_a_process_is_known_by_its_start_not_by_its_number_alone():
    own = ProcessName.own()

    assert ProcessName.parse(str(own)) == own
    assert not own.is_surely_gone()
    assert ProcessName(own.place, own.pid, "0").is_surely_gone()
    assert not ProcessName("elsewhere", own.pid, "0").is_surely_gone()
