"""How steps ended, counted by a worker and added to the database in batches: a write for each step would be in the way."""

import logging
import threading
from collections import defaultdict

from sqlalchemy.exc import SQLAlchemyError

from gripwright.store.engines import Database
from gripwright.store.step_stats import STORED, Ended, Kind, StepStatRepository, kind_of

_log = logging.getLogger(__name__)

_FLUSH_S = 2.0


class Tally:
    """Counts from any thread. A worker that is killed loses the counts of its last two seconds."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._lock = threading.Lock()
        self._counted: dict[Kind, Ended] = defaultdict(lambda: Ended(0, 0.0))
        self._waiting, self._stopped = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="tally", daemon=True)

    def start(self) -> None:
        """Begin to write."""
        self._thread.start()

    def stop(self) -> None:
        """Write what is left, and end."""
        self._stopped.set()
        self._waiting.set()
        self._thread.join()
        self.flush()

    def step_ended(self, stage: str, outcome: str, seconds: float) -> None:
        """A step was run."""
        self._add(kind_of(stage, outcome, seconds), Ended(1, seconds))

    def steps_stored(self, stage: str, steps: int) -> None:
        """Results that were there already."""
        if steps:
            self._add(kind_of(stage, STORED, 0.0), Ended(steps, 0.0))

    def flush(self) -> None:
        """Write what was counted since the last time; what cannot be written now is kept for the next time."""
        with self._lock:
            self._waiting.clear()
            counted, self._counted = self._counted, defaultdict(lambda: Ended(0, 0.0))
        if not counted:
            return
        try:
            with self._database.write_sessions.begin() as session:
                StepStatRepository(session).add(counted)
        except SQLAlchemyError as error:
            _log.warning("durations of steps could not be stored, and will be later: %s", type(error).__name__)
            for kind, ended in counted.items():
                self._add(kind, ended)

    def _add(self, kind: Kind, ended: Ended) -> None:
        with self._lock:
            before = self._counted[kind]
            self._counted[kind] = Ended(before.steps + ended.steps, before.seconds + ended.seconds)
            self._waiting.set()

    def _run(self) -> None:
        while not self._stopped.is_set():
            self._waiting.wait()
            self._stopped.wait(_FLUSH_S)
            self.flush()
