"""The log: one line an event on standard error, as JSON or for people, with what it belongs to. No secret, no forged line."""

import logging
import re
import sys
from collections.abc import Mapping
from typing import Any

import structlog
from structlog.contextvars import merge_contextvars
from structlog.stdlib import ProcessorFormatter, add_log_level, add_logger_name
from structlog.typing import EventDict, Processor

from gripwright.settings import Settings

FIELDS = "fields"
"""Key of a record's `extra`: a mapping whose entries become fields of the line."""

_CHATTY = ("alembic", "httpx", "httpcore")  # tell at INFO what others would not miss
_SECRETS = re.compile(r"(whsec_|gwk_|\b[Bb]earer )[^\s\"',)]+|(://[^/\s:@]*:)[^/\s@]+(?=@)")
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069]")
_BREAKS = re.compile(r"[\t\n]")

_of_process: dict[str, str] = {}


def configure_logs(settings: Settings) -> None:
    """Let every logger of this process, those of the libraries included, write that way."""
    as_json = settings.log_format == "json" or (settings.log_format is None and not sys.stderr.isatty())
    formatter = ProcessorFormatter(
        foreign_pre_chain=[merge_contextvars, _with_process, add_log_level, add_logger_name, _with_fields],
        processors=[
            structlog.processors.TimeStamper(fmt="iso", utc=True),
            ProcessorFormatter.remove_processors_meta,
            structlog.processors.format_exc_info,
            _without_secrets,
            *_renderers(as_json),
        ],
    )
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(formatter)
    root = logging.getLogger()
    root.handlers = [handler]
    root.setLevel(settings.log_level)
    for name in _CHATTY:
        logging.getLogger(name).setLevel(max(logging.WARNING, root.level))


def take_over(name: str) -> None:
    """Let a library that writes its own lines write through the root, as all others do."""
    logger = logging.getLogger(name)
    logger.handlers, logger.propagate = [], True


def of_this_process(**fields: str) -> None:
    """Fields of every line that this process writes from now on."""
    _of_process.update(fields)


def _renderers(as_json: bool) -> list[Processor]:
    if as_json:
        return [structlog.processors.JSONRenderer()]
    plain = structlog.dev.plain_traceback
    return [_printable, structlog.dev.ConsoleRenderer(colors=sys.stderr.isatty(), exception_formatter=plain)]


def _with_process(logger: Any, method: str, event: EventDict) -> EventDict:
    for name, value in _of_process.items():
        event.setdefault(name, value)
    return event


def _with_fields(logger: Any, method: str, event: EventDict) -> EventDict:
    fields: Mapping[str, Any] = getattr(event["_record"], FIELDS, {})
    event.update(fields)
    if event["_record"].exc_text:  # of a child process: the exception itself stayed there
        event["exception"] = event["_record"].exc_text
    return event


def _without_secrets(logger: Any, method: str, event: EventDict) -> EventDict:
    """Nobody logs a secret on purpose; an exception may hold one."""
    for name, value in event.items():
        if isinstance(value, str):
            event[name] = _SECRETS.sub(lambda found: (found[1] or found[2]) + "[hidden]", value)
    return event


def _printable(logger: Any, method: str, event: EventDict) -> EventDict:
    """What callers send must not look like a line of its own, nor steer a terminal. (JSON escapes it anyway.)"""
    for name, value in event.items():
        if isinstance(value, str):
            shown = value if name == "exception" else _BREAKS.sub(_escaped, value)
            event[name] = _CONTROL.sub(_escaped, shown)
    return event


def _escaped(found: re.Match[str]) -> str:
    return found[0].encode("unicode_escape").decode("ascii")
