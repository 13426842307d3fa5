"""Whatever the OpenAPI document allows or forbids is sent to a running service, and every answer must be as it says.

`python -m tests.soak.api_contract` is the long form; a test runs the short one. The stream of events is left out.
"""

import json
import os
import re
import secrets
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from gripwright.domain.access import AccessScope  # noqa: E402 - the path stands above
from gripwright.jobs.keys import create_key  # noqa: E402
from gripwright.jobs.requests import request_design  # noqa: E402
from gripwright.jobs.webhook_signing import new_secret  # noqa: E402
from gripwright.registry.description import describe_in_child  # noqa: E402
from gripwright.settings import Settings  # noqa: E402
from gripwright.store.actuators import ActuatorRepository  # noqa: E402
from gripwright.store.artifacts import ArtifactStore  # noqa: E402
from gripwright.store.columns import new_id, utc_now  # noqa: E402
from gripwright.store.engines import Database  # noqa: E402
from gripwright.store.events import WEBHOOK_EVENTS  # noqa: E402
from gripwright.store.migrate import migrate  # noqa: E402
from gripwright.store.models import WebhookRow  # noqa: E402
from gripwright.store.webhooks import WebhookRepository  # noqa: E402
from service_factory import finish_design, store_product  # noqa: E402
from service_process import running_service  # noqa: E402

LEAST_REQUESTS = 5_000
EXAMPLES = 140
HOOKS = HERE / "_contract_hooks.py"
PRODUCTS = 12
FILES = {"bom.csv": b"gripper\r\n", "report.html": b"<!doctype html>", "grippers/G1/finger.step": b"ISO-10303-21;" * 99}
DESCRIPTION = describe_in_child()
ALL_PHASES = "examples,coverage,fuzzing,stateful"
SETTINGS = {
    "GRIPWRIGHT_ACCESS_REQUIRED": "true",
    "GRIPWRIGHT_WEBHOOK_PRIVATE_TARGETS": "true",  # nothing is sent: it has no workers
    "GRIPWRIGHT_WAIT_MAX_S": "1",  # no design ends here
    "GRIPWRIGHT_RATE_READS": "1000000",  # "too many requests" would be the answer to most, and say nothing of them
    "GRIPWRIGHT_RATE_WRITES": "1000000",
    "GRIPWRIGHT_RATE_BURST": "1000000",
}


@dataclass(frozen=True)
class Outcome:
    """How many requests were sent, what was wrong with the answers, and what the service's log says of itself."""

    requests: int
    failures: int
    defects: int
    seconds: float
    output: str

    @property
    def is_clean(self) -> bool:
        """Whether it ran to its end and found nothing."""
        return self.requests > 0 and self.failures == 0 and self.defects == 0 and "No issues found" in self.output


def check(*, examples: int, seed: int, phases: str = ALL_PHASES, workers: int = 1) -> Outcome:
    """Send up to `examples` requests to each operation in each phase, to a service that holds a product and asks for a key."""
    with tempfile.TemporaryDirectory(prefix="gripwright-contract-") as name:
        folder = Path(name)
        key = populate(folder / "data")
        with running_service(workers=0, folder=folder, **SETTINGS) as service:
            started = time.monotonic()
            document = f"{service.address}/openapi.json"
            options = [document, "--phases", phases, "--max-examples", examples, "--seed", seed, "--workers", workers]
            output = run_schemathesis(options, key, folder)
            elapsed = time.monotonic() - started
        defects = (folder / "log").read_text().count("Traceback")
    found = re.search(r"(\d+) generated(?:, (\d+) found (\d+) unique failures?)?", output)
    requests, failures = (int(found[1]), int(found[3] or 0)) if found else (0, 0)
    return Outcome(requests=requests, failures=failures, defects=defects, seconds=elapsed, output=output)


def populate(data: Path) -> str:
    """Something of each kind, for what is not found teaches little, and a key that may do everything."""
    data.mkdir()
    database, artifacts = Database(Settings(data_dir=data).resolved_database_url), ArtifactStore(data / "artifacts")
    migrate(database)
    webhook_id = store_webhook(database)
    products = [store_product(database, artifacts) for _ in range(PRODUCTS)]
    designs = [store_design(database, artifacts, product_id) for product_id in products for _ in range(2)]
    for design_id in designs[::2]:
        finish_design(database, artifacts, design_id, FILES)
    with database.write_sessions.begin() as session:
        made = create_key(session, "contract", AccessScope.ADMIN, timedelta(hours=2), utc_now(), actor="cli:contract")
        messages = [row.id for row in WebhookRepository(session).deliveries(webhook_id, limit=PRODUCTS)]
        actuator = ActuatorRepository(session).all()[0]
    database.dispose()
    held = {
        "product_id": products,
        "design_id": designs,
        "job_id": designs,
        "component_id": ["base", "rotor"],
        "path": list(FILES),
        "webhook_id": [webhook_id],
        "delivery_id": messages,
        "maker": [actuator.maker],
        "model": [actuator.model],
        "kind": ["segmenter"],
        "name": ["sdf"],
    }
    assert all(held.values())
    (data / "held.json").write_text(json.dumps(held))
    return made.word


def store_webhook(database: Database) -> str:
    """One that nothing is sent to, for there is no worker."""
    now = utc_now()
    row = WebhookRow(id=new_id(now), url="http://127.0.0.1:9/", events=list(WEBHOOK_EVENTS), secret=new_secret(), created_at=now)
    row.enabled, row.disabled_reason = True, ""
    with database.write_sessions.begin() as session:
        WebhookRepository(session).add(row)
    return row.id


def store_design(database: Database, artifacts: ArtifactStore, product_id: str) -> str:
    """A design that waits."""
    with database.write_sessions.begin() as session:
        return request_design(session, artifacts, DESCRIPTION, product_id, {}, utc_now()).id


def run_schemathesis(options: list[object], key: str, folder: Path) -> str:
    """Its output."""
    command = [
        *(Path(sys.executable).parent / "schemathesis", "--config-file", HERE / "schemathesis.toml", "run", *options),
        *("--checks", "all", "--warnings", "off"),
        *("--exclude-operation-id", "follow_job", "--continue-on-failure", "--suppress-health-check", "all"),
        *("--header", f"Authorization: Bearer {key}", "--request-timeout", 60, "--max-response-time", 45, "--no-color"),
    ]
    environment = {**os.environ, "CONTRACT_HELD": str(folder / "data" / "held.json"), "SCHEMATHESIS_HOOKS": str(HOOKS)}
    finished = subprocess.run(
        [str(word) for word in command], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    return finished.stdout + finished.stderr


def main() -> int:
    """The long form; 0 where every answer was as the document says."""
    outcome = check(examples=EXAMPLES, seed=secrets.randbelow(2**32))
    print(outcome.output)
    print(f"{outcome.requests} requests, {outcome.failures} failures, {outcome.defects} defects, {outcome.seconds:.0f} s")
    return int(not outcome.is_clean or outcome.requests < LEAST_REQUESTS)


if __name__ == "__main__":
    sys.exit(main())
