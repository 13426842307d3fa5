"""Whether the service can do its work now. What is wrong in detail stands in the log: the answer is open to everybody."""

import logging
import shutil
import tempfile
from collections.abc import Callable, Iterator

from sqlalchemy.exc import SQLAlchemyError

from gripwright.domain.errors import Fault, GripwrightError
from gripwright.http.state import State
from gripwright.store.migrate import require_current, require_writable

_log = logging.getLogger(__name__)


def unready(service: State) -> Iterator[Fault]:
    """The checks that fail now, by name, each with what may be told."""
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
    settings = service.settings
    with tempfile.TemporaryFile(dir=settings.data_dir) as file:
        file.write(b"ready")
    service.artifacts.put(b"ready")
    free_mb = shutil.disk_usage(settings.data_dir).free // 2**20
    return None if free_mb >= settings.free_mb_min else f"{free_mb} MB are free, at least {settings.free_mb_min} MB are needed"


def _plugins(service: State) -> str | None:
    if service.plugins is not None:
        return None
    return "the installed plug-ins cannot be listed" if service.plugins_problem else "the plug-ins are still being listed"


def _workers(service: State) -> str | None:
    """Only where this process keeps workers: others may be anywhere."""
    return "no worker is running" if service.live_workers is not None and service.live_workers() == 0 else None
