from datetime import timedelta

from gripwright.domain.access import AccessScope
from gripwright.store.columns import utc_now
from gripwright.store.models import WorkerRow


def test_workers_of_all_hosts_are_listed_live_or_stale_to_whoever_may_read(closed, keys, problem):
    now = utc_now()
    with closed.service.database.write_sessions.begin() as session:
        for name, silent_s in (("one", 1), ("two", 60)):
            fields = {"id": name, "host": f"host-{name}", "process": "elsewhere 7 1", "pid": 7, "version": "1", "steps": 2}
            session.add(WorkerRow(**fields, started_at=now - timedelta(hours=1), heartbeat_at=now - timedelta(seconds=silent_s)))

    answer = closed.get("/api/v1/workers", headers={"Authorization": f"Bearer {keys[AccessScope.READ]}"})

    shown = [(worker["host"], worker["state"], worker["steps"]) for worker in answer.json()["items"]]
    assert shown == [("host-one", "live", 2), ("host-two", "stale", 2)]
    problem(closed.get("/api/v1/workers"), 401)
