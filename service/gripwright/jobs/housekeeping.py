"""What nobody needs any more is removed from the storage: artifacts that no row names, old step results, parts of files.

A storage belongs to one database: what another one names would be removed.
"""

import logging
import threading
import time
from dataclasses import dataclass

from sqlalchemy.exc import DBAPIError

from gripwright.domain.errors import StorageUnavailable
from gripwright.settings import Settings
from gripwright.store.artifacts import artifact_name
from gripwright.store.engines import Database
from gripwright.store.files import Files
from gripwright.store.named import oldest_start
from gripwright.store.storage import ARTIFACTS, STEPS, open_files
from gripwright.store.transfer import names_in
from gripwright.store.workers import WorkerRegister

log = logging.getLogger(__name__)

GRACE_S = 86_400.0
"""How long an artifact may lie unnamed: between its upload, or a design's last step, and the row that names it."""

_RECENT_S = 3600.0  # what is younger may be in use by a command that leaves no row
_FIRST_S, _INTERVAL_S = 300.0, 3600.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Cleaned:
    """What was removed."""

    artifacts: int
    steps: int
    parts: int
    bytes: int


def clean(settings: Settings, database: Database, *, grace_s: float = GRACE_S) -> Cleaned:
    """Remove what nobody needs; safe while others upload and design."""
    now_s, url = time.time(), settings.resolved_storage_url
    artifacts, steps = open_files(url, ARTIFACTS), open_files(url, STEPS)
    orphans = _remove_orphans(artifacts, database, now_s - grace_s)
    spare = _remove_spare_steps(
        steps,
        keep_after_s=_needed_since(database, now_s) - steps.refresh_after_s,
        before_s=now_s - settings.steps_max_days * 86_400.0,
        max_bytes=settings.steps_max_bytes,
    )
    parts = sum(place.remove_parts(now_s - _RECENT_S) for place in (artifacts, steps))
    return Cleaned(artifacts=len(orphans), steps=len(spare), parts=parts, bytes=sum(orphans) + sum(spare))


def _remove_orphans(artifacts: Files, database: Database, before_s: float) -> list[int]:
    """The sizes of the artifacts that were removed. The files are listed before the names: what is named since is young."""
    old = [state for state in artifacts.all() if state.modified_s <= before_s]
    named = {artifact_name(sha256) for sha256 in names_in(database)}
    return [state.size for state in old if state.name not in named and artifacts.remove(state.name, before_s)]


def _remove_spare_steps(steps: Files, *, keep_after_s: float, before_s: float, max_bytes: int | None) -> list[int]:
    """The sizes of the step results that were removed, the least recently used first."""
    states = sorted(steps.all(), key=lambda state: state.modified_s)
    total, removed = sum(state.size for state in states), []
    for state in states:
        is_needed = state.modified_s > keep_after_s
        is_spare = state.modified_s <= before_s or (max_bytes is not None and total > max_bytes)
        if is_needed or not is_spare:
            break
        if steps.remove(state.name, keep_after_s):
            total -= state.size
            removed.append(state.size)
    return removed


def _needed_since(database: Database, now_s: float) -> float:
    """The moment since when whatever was used may be needed still."""
    started = oldest_start(database)
    recent_s = now_s - _RECENT_S
    return recent_s if started is None else min(recent_s, started.timestamp())


class Housekeeping:
    """Cleans once an hour, in the worker that has been there longest."""

    def __init__(self, settings: Settings, worker_id: str) -> None:
        self._settings, self._worker_id = settings, worker_id
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="housekeeping", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """End; what is being removed is not waited for."""
        self._stop.set()

    def _run(self) -> None:
        database = Database(self._settings.resolved_database_url)
        pause_s = _FIRST_S
        while not self._stop.wait(pause_s):
            pause_s = _INTERVAL_S
            try:
                if min(row.id for row in WorkerRegister(database).all()) == self._worker_id:
                    log.info("cleaned: %s", clean(self._settings, database))
            except (DBAPIError, OSError, StorageUnavailable) as error:
                log.warning("the storage could not be cleaned, and will be in an hour: %s", error)
