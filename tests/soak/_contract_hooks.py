"""Names of what the service holds, in place of invented ones."""

import json
import os
import re
import zlib
from pathlib import Path
from typing import Any

import schemathesis

HELD: dict[str, list[str]] = json.loads(Path(os.environ["CONTRACT_HELD"]).read_text())
ID = re.compile("[0-9a-f]{32}")  # from an answer: it must stay what it is


@schemathesis.hook
def before_call(context: schemathesis.HookContext, case: schemathesis.Case, kwargs: dict[str, Any]) -> None:
    """Every second invented name becomes one that is there."""
    for name, value in (case.path_parameters or {}).items():
        if (case.method, name) == ("DELETE", "webhook_id"):
            continue  # there is one
        number = zlib.crc32(repr(value).encode())
        if name in HELD and number % 2 and not ID.fullmatch(str(value)):
            case.path_parameters[name] = HELD[name][number // 2 % len(HELD[name])]
