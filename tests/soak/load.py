"""Many clients read and write while two workers compute, then a long queue drains. What `make soak` runs; `--help` says more.

Clients think for a second between requests, as people and synchronising systems do. Times are taken at the client, so they
hold what the service, the network of this machine and the client's own share of its two cores take.
"""

import argparse
import asyncio
import collections
import itertools
import random
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import httpx
import psutil

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from service_factory import make_document, make_package
from service_process import running_service

READS_P95_S, WRITES_P95_S = 0.100, 0.250
THINK_S = 1.0
ENDED = ("complete", "incomplete", "failed", "cancelled")


@dataclass
class Measured:
    """Seconds and statuses of the requests of a run, by what was asked."""

    seconds: dict[str, list[float]] = field(default_factory=lambda: collections.defaultdict(list))
    statuses: collections.Counter = field(default_factory=collections.Counter)
    designs: list[str] = field(default_factory=list)


class Client:
    """One of the clients: picks what to ask, asks, thinks."""

    def __init__(self, http: httpx.AsyncClient, known: dict[str, list[str]], measured: Measured, seed: int) -> None:
        self._http, self._known, self._measured = http, known, measured
        self._random = random.Random(seed)
        self._numbers = itertools.count(seed * 1_000_000)
        self._actions = {
            self.list_products: 12, self.read_product: 20, self.read_component: 10, self.read_mesh: 6, self.list_jobs: 10,
            self.read_job: 12, self.read_design: 10, self.read_plugins: 2, self.read_actuators: 3,
            self.upload: 2, self.change_component: 6, self.change_operations: 3, self.change_actuator: 3, self.design: 3,
        }  # fmt: skip

    async def live_until(self, end_s: float) -> None:
        await asyncio.sleep(self._random.random() * THINK_S)
        while time.monotonic() < end_s:
            (action,) = self._random.choices(list(self._actions), list(self._actions.values()))
            await action()
            await asyncio.sleep(self._random.expovariate(1.0 / THINK_S))

    async def list_products(self) -> None:
        await self._ask("read", "GET", "/products?limit=50")

    async def read_product(self) -> None:
        await self._ask("read", "GET", f"/products/{self._a('products')}")

    async def read_component(self) -> None:
        await self._ask("read", "GET", f"/products/{self._a('products')}/components/rotor")

    async def read_mesh(self) -> None:
        await self._ask("read", "GET", f"/products/{self._a('products')}/components/rotor/mesh.glb")

    async def list_jobs(self) -> None:
        await self._ask("read", "GET", "/jobs?limit=50")

    async def read_job(self) -> None:
        await self._ask("read", "GET", f"/jobs/{self._a('designs')}")

    async def read_design(self) -> None:
        await self._ask("read", "GET", f"/designs/{self._a('designs')}")

    async def read_plugins(self) -> None:
        await self._ask("read", "GET", "/plugins")

    async def read_actuators(self) -> None:
        await self._ask("read", "GET", "/actuators")

    async def upload(self) -> None:
        number = next(self._numbers)
        package = make_package(make_document(part_number=f"L-{number}"), size_mm=10.0 + self._random.random())
        answer = await self._ask("write", "POST", "/products", files={"package": ("p.zip", package, "application/zip")})
        self._known["products"].append(answer.json()["id"])

    async def change_component(self) -> None:
        change = {"friction": round(0.1 + 0.2 * self._random.random(), 3)}
        await self._ask("write", "PATCH", f"/products/{self._a('products')}/components/rotor", json=change)

    async def change_operations(self) -> None:
        operations = {"operations": make_document()["operations"]}
        await self._ask("write", "PUT", f"/products/{self._a('products')}/operations", json=operations)

    async def change_actuator(self) -> None:
        body = {"gripper_type": "centric-3", "stroke": 1 + self._random.random(), "grip_force": 100}
        await self._ask("write", "PUT", f"/actuators/Load/L-{self._random.randrange(20)}", json=body)

    async def design(self) -> None:
        # Two in a hundred are new work for a minute of a core, the others a product of two wedges.
        product, options = self._a("products"), {}
        if self._random.random() < 0.02:
            product, options = self._known["heavy"][0], {"seed": next(self._numbers) % 2**31}
        await self.request_design(product, options)

    async def request_design(self, product: str, options: dict) -> None:
        answer = await self._ask("write", "POST", f"/products/{product}/designs", json={"options": options})
        self._known["designs"].append(answer.json()["id"])
        self._measured.designs.append(answer.json()["id"])

    def _a(self, kind: str) -> str:
        return self._random.choice(self._known[kind])

    async def _ask(self, kind: str, method: str, path: str, **request) -> httpx.Response:
        began_s = time.monotonic()
        answer = await self._http.request(method, f"/api/v1{path}", **request)
        taken_s = time.monotonic() - began_s
        template = "/".join(step.partition("?")[0] for step in path.split("/") if len(step) != 32 and not step.startswith("L-"))
        self._measured.seconds[kind].append(taken_s)
        self._measured.seconds[f"{method} {template}"].append(taken_s)
        self._measured.statuses[answer.status_code] += 1
        return answer


def percentile(values: list[float], share: float) -> float:
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


async def prepare(http: httpx.AsyncClient, heavy: bytes) -> dict[str, list[str]]:
    """A few products and designs to begin with."""
    known: dict[str, list[str]] = {"products": [], "designs": [], "heavy": []}
    light = [("products", make_package(make_document(part_number=f"S-{number}"))) for number in range(20)]
    for kind, package in [("heavy", heavy), *light]:
        answer = await http.post("/api/v1/products", files={"package": ("p.zip", package, "application/zip")}, timeout=60)
        known[kind].append(answer.raise_for_status().json()["id"])
    for product in known["products"][:5]:
        answer = await http.post(f"/api/v1/products/{product}/designs", json={}, timeout=60)
        known["designs"].append(answer.raise_for_status().json()["id"])
    return known


async def drain(http: httpx.AsyncClient, designs: list[str], patience_s: float) -> dict[str, int]:
    """Wait until no job is queued or running; how the given designs ended."""
    deadline_s = time.monotonic() + patience_s
    while True:
        counts = {}
        for status in ("queued", "running"):
            counts[status] = len((await http.get(f"/api/v1/jobs?status={status}&limit=200", timeout=60)).json()["items"])
        if not any(counts.values()) or time.monotonic() > deadline_s:
            break
        await asyncio.sleep(1.0)
    ends: collections.Counter = collections.Counter()
    for design in designs:
        ends[(await http.get(f"/api/v1/jobs/{design}", timeout=60)).json()["status"]] += 1
    return dict(ends)


def print_table(measured: Measured) -> None:
    """Times by what was asked."""
    for name, values in sorted(measured.seconds.items(), key=lambda item: (" " in item[0], item[0])):
        figures = {"median": percentile(values, 0.5), "p95": percentile(values, 0.95), "p99": percentile(values, 0.99)}
        columns = "  ".join(f"{label} {1000 * value:6.1f}" for label, value in [*figures.items(), ("max", max(values))])
        print(f"{name:45} {len(values):6}  {columns} ms")
    print("statuses", dict(sorted(measured.statuses.items())))


def broken_promises(measured: Measured) -> list[str]:
    """What was slower than it may be, and the answers that tell of a defect."""
    limits = {"read": READS_P95_S, "write": WRITES_P95_S}
    slow = [
        f"p95 of {kind}s is {1000 * p95:.0f} ms, at most {1000 * limit:.0f}"
        for kind, limit in limits.items()
        if (p95 := percentile(measured.seconds[kind], 0.95)) > limit
    ]
    return slow + [f"{count} answers were {status}" for status, count in measured.statuses.items() if status >= 500]


async def put_under_load(
    address: str, heavy: bytes, *, clients: int, seconds: float, queue: int, patience_s: float
) -> tuple[Measured, dict[str, int]]:
    """What was measured while the clients lived, and how all designs ended, those included that were queued at once after it."""
    measured = Measured()
    limits = httpx.Limits(max_connections=clients, max_keepalive_connections=clients)
    async with httpx.AsyncClient(base_url=address, limits=limits, timeout=60) as http:
        known = await prepare(http, heavy)
        crowd = [Client(http, known, measured, seed) for seed in range(1, clients + 1)]
        end_s = time.monotonic() + seconds
        await asyncio.gather(*(client.live_until(end_s) for client in crowd))
        print_table(measured)
        began_s = time.monotonic()
        for number in range(queue):
            await crowd[0].request_design(known["products"][number % len(known["products"])], {})
        queued_s = time.monotonic()
        ends = await drain(http, measured.designs, patience_s)
    waited_s = time.monotonic() - queued_s
    print(f"{queue} designs queued in {queued_s - began_s:.0f} s, and {waited_s:.0f} s later every design had ended: {ends}")
    return measured, ends


def main() -> int:
    """The number of promises that were broken."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--clients", type=int, default=50)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--queue", type=int, default=1000, help="designs queued at once after that")
    parser.add_argument("--patience", type=float, default=3600.0, help="seconds for the queue to drain")
    asked = parser.parse_args()
    with running_service(workers=2) as service:
        process, seconds = psutil.Process(service.process.pid), 60 * asked.minutes
        how = {"clients": asked.clients, "seconds": seconds, "queue": asked.queue, "patience_s": asked.patience}
        load = put_under_load(service.address, service.sample_package(), **how)
        measured, ends = asyncio.run(load)
        used = process.cpu_times()
        print(f"the service itself: {used.user + used.system:.0f} s of processor, {process.memory_info().rss / 2**20:.0f} MiB")
    broken = broken_promises(measured)
    if set(ends) != {"succeeded"}:
        broken.append(f"not every design succeeded: {ends}")
    print("\n".join(broken) or "all promises kept")
    return len(broken)


if __name__ == "__main__":
    sys.exit(main())
