"""The parts of the running service, made once at its start."""

import logging
import threading
from collections.abc import Callable

from gripwright.cad.spare import SpareReader
from gripwright.http.audit_trail import AuditTrail
from gripwright.http.gate import Gate
from gripwright.http.idempotency import KeptAnswers
from gripwright.http.metrics import Metrics
from gripwright.http.rate_limits import RateLimits
from gripwright.http.turns import Turns
from gripwright.http.waiting import EndWatch
from gripwright.registry.description import RegistryDescription, RegistryUnreadable, describe_in_child
from gripwright.settings import Settings
from gripwright.store.engines import Database
from gripwright.store.storage import open_limited_artifacts
from gripwright.traces import tracer_from_environment

_log = logging.getLogger(__name__)


class State:
    """Database, artifacts, and what is installed (listed by a child process, while the service answers already)."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.database = Database(settings.resolved_database_url)
        self.artifacts = open_limited_artifacts(settings)
        self.gate = Gate(settings, self.database)
        self.audit = AuditTrail(self.database, days=settings.audit_days, with_reads=settings.audit_reads)
        self.ends = EndWatch(self.database, seats=settings.wait_requests)
        self.answers = KeptAnswers(self.database, hours=settings.idempotency_hours)
        self.limits = RateLimits(settings)
        self.turns = Turns(settings.heavy_requests, wait_s=settings.heavy_wait_s)
        self.package_limits = settings.package_limits
        self.spare_reader = SpareReader(self.package_limits)
        self.plugins: RegistryDescription | None = None
        self.plugins_problem = ""
        self.metrics = Metrics()
        self.tracer = tracer_from_environment()
        self.live_workers: Callable[[], int] | None = None  # of this process, where it keeps any
        self.ready_s = 1.0  # how long an answer about readiness holds
        self.is_ending = False  # streams end, so that their listeners go on elsewhere
        self._listing = threading.Thread(target=self._list_plugins, name="plug-ins", daemon=True)

    def start(self) -> None:
        """Begin to list the plug-ins, and to keep a process ready that reads uploads."""
        self._listing.start()
        self.spare_reader.start()

    def stop(self) -> None:
        """End the process that waits for uploads, close the database, and send the spans that wait."""
        self.spare_reader.stop()
        if self.tracer is not None:
            self.tracer.stop()
        self.database.dispose()

    def wait_for_plugins(self, timeout_s: float) -> None:
        """Wait until the plug-ins are listed."""
        self._listing.join(timeout_s)

    def _list_plugins(self) -> None:
        allow, strict = self.settings.plugins_allow, self.settings.plugins_strict
        try:
            self.plugins = describe_in_child(allow=allow, strict=strict)
        except RegistryUnreadable as error:
            self.plugins_problem = str(error)
            _log.error("%s", error)
