"""How much faster two workers on PostgreSQL finish the same designs than one: `python tests/soak/two_workers.py [DESIGNS]`.

Wall-clock counts only on a machine that is otherwise idle. Beside it stand the processor time that the workers took and what
others took meanwhile, out of the whole machine.
"""

import sys
import tempfile
import time
from pathlib import Path

import psutil

sys.path.insert(0, str(Path(__file__).parents[1]))

from postgresql_server import PostgresqlServer, running_postgresql
from soak._fleet import Fleet, end_as_ctrl_c

AT_LEAST = 1.5
_PATIENCE_S = 3600.0


def main(designs: int) -> int:
    with running_postgresql() as server:
        walls = [_measure(server, workers, designs) for workers in (1, 2)]
    ratio = walls[0] / walls[1]
    print(f"two workers are {ratio:.2f} times as fast as one; at least {AT_LEAST} is asked for")
    return 0 if ratio >= AT_LEAST else 1


def _measure(server: PostgresqlServer, workers: int, designs: int) -> float:
    with tempfile.TemporaryDirectory(prefix="gripwright-soak-") as folder:
        variables = {
            "GRIPWRIGHT_DATABASE_URL": server.create_database(f"data_{workers}"),
            "GRIPWRIGHT_JOBS_DATABASE_URL": server.create_database(f"jobs_{workers}"),
        }
        fleet = Fleet(Path(folder), variables)
        try:
            for _ in range(workers):
                fleet.start_worker()
            fleet.wait_for_workers(workers)
            fleet.wait(fleet.request(2 * workers, first=1000), _PATIENCE_S)  # everything is loaded by then
            ours_s, all_s, start_s = fleet.cpu_s(), _busy_s(), time.monotonic()
            statuses = fleet.wait(fleet.request(designs), _PATIENCE_S)
            wall_s, ours_s, all_s = time.monotonic() - start_s, fleet.cpu_s() - ours_s, _busy_s() - all_s
        finally:
            fleet.stop()
    assert set(statuses.values()) == {"succeeded"}, statuses
    print(
        f"{workers} worker(s), {designs} designs: {wall_s:.1f} s; processor time of the workers {ours_s:.1f} s, "
        f"of everything else {all_s - ours_s:.1f} s of {wall_s * (psutil.cpu_count() or 1):.0f} s",
        flush=True,
    )
    return wall_s


def _busy_s() -> float:
    times = psutil.cpu_times()
    return sum(times) - times.idle - times.iowait - times.guest - times.guest_nice


if __name__ == "__main__":
    end_as_ctrl_c()
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 20))
