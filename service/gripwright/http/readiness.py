"""Whether the service can do its work now. What is wrong in detail stands in the log: the answer is open to everybody."""

import logging
import threading
import time
from collections.abc import Callable, Iterator

from sqlalchemy.exc import SQLAlchemyError

from gripwright.domain.errors import Fault, GripwrightError
from gripwright.http.state import State
from gripwright.store.migrate import require_current, require_writable

_log = logging.getLogger(__name__)


class Readiness:
    """The checks, made once a second however many ask: they write, and anybody may ask."""

    def __init__(self, service: State) -> None:
        self._service = service
        self._lock = threading.Lock()
        self._faults: tuple[Fault, ...] = ()
        self._until_s = 0.0

    def faults(self) -> tuple[Fault, ...]:
        """The checks that fail, by name, each with what may be told."""
        with self._lock:
            if time.monotonic() >= self._until_s:
                self._faults = tuple(_faults(self._service))
                self._until_s = time.monotonic() + self._service.ready_s
            return self._faults


def _faults(service: State) -> Iterator[Fault]:
    checks: dict[str, Callable[[State], str | None]] = {
        "database": _database,
        "storage": _storage,
        "plugins": _plugins,
        "workers": _workers,
    }
    for name, check in checks.items():
        try:
            failure = check(service)
        except (SQLAlchemyError, OSError):
            _log.exception("the check of the %s failed", name)
            failure = "cannot be used; the service's log says why"
        if failure is not None:
            yield Fault(pointer=f"/checks/{name}", message=failure)


def _database(service: State) -> str | None:
    try:
        require_current(service.database)
    except GripwrightError as error:
        return error.detail
    require_writable(service.database)
    return None


def _storage(service: State) -> str | None:
    """Not its quota: what is full can be read still."""
    least = service.settings.disk_free_min_bytes
    try:
        service.artifacts.files.refresh("ready", b"ready")
        free = service.artifacts.files.free_bytes()
    except GripwrightError as error:
        return error.detail
    return None if free is None or free >= least else f"{free} bytes are free on the disk, {least} must stay free"


def _plugins(service: State) -> str | None:
    if service.plugins is not None:
        return None
    return "the installed plug-ins cannot be listed" if service.plugins_problem else "the plug-ins are still being listed"


def _workers(service: State) -> str | None:
    """Only where this process keeps workers: others may be anywhere."""
    return "no worker is running" if service.live_workers is not None and service.live_workers() == 0 else None
