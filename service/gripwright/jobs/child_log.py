"""What a child process logs, written by its parent."""

import logging
import traceback
from collections.abc import Callable
from typing import Any


class LogOfParent(logging.Handler):
    """Lets the parent write what the child logs: it knows what for, and how."""

    def __init__(self, send: Callable[[str, Any], None]) -> None:
        super().__init__(logging.INFO)
        self._send = send

    def emit(self, record: logging.LogRecord) -> None:
        """Send it on, with its trace as text."""
        trace = "".join(traceback.format_exception(*record.exc_info)) if record.exc_info else None
        self._send("log", [record.name, record.levelno, record.getMessage(), trace])


def log_for_child(name: str, level: int, message: str, trace: str | None) -> None:
    """Write what a child has logged, as its own logger would."""
    logger = logging.getLogger(name)
    record = logger.makeRecord(name, level, "", 0, message, (), None)
    record.exc_text = trace
    if logger.isEnabledFor(level):
        logger.handle(record)
