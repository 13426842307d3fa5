"""The parts of the running service, made once at its start."""

import logging
import threading
from collections import Counter

from gripwright.cad.limits import Limits
from gripwright.http.audit_trail import AuditTrail
from gripwright.http.gate import Gate
from gripwright.registry.description import RegistryDescription, RegistryUnreadable, describe_in_child
from gripwright.settings import Settings
from gripwright.store.engines import Database
from gripwright.store.storage import open_limited_artifacts

_log = logging.getLogger(__name__)


class State:
    """Database, artifacts, and what is installed (listed by a child process, while the service answers already)."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.database = Database(settings.resolved_database_url)
        self.artifacts = open_limited_artifacts(settings)
        self.gate = Gate(settings, self.database)
        self.audit = AuditTrail(self.database, days=settings.audit_days, with_reads=settings.audit_reads)
        self.package_limits = Limits()
        self.plugins: RegistryDescription | None = None
        self.plugins_problem = ""
        self.requests: Counter[tuple[str, str, int]] = Counter()  # method, route, status
        self._listing = threading.Thread(target=self._list_plugins, name="plug-ins", daemon=True)

    def start(self) -> None:
        """Begin to list the plug-ins."""
        self._listing.start()

    def stop(self) -> None:
        """Close the database."""
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
