"""`--set KEY=VALUE` as options of a plan."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gripwright.design.owned import specifications
from gripwright.design.plan import Plan
from gripwright.domain.errors import Fault, InvalidInput, InvalidPlan

SET_HELP = "an option of the plan, as KEY=VALUE; VALUE is JSON where it can be, else text; a list by commas"
OWNED_HELP = "grippers that are at hand: a JSON list as of the option `owned`, or an earlier design.json"

_LISTS = frozenset(name for name, field in Plan.model_fields.items() if "tuple" in str(field.annotation))
_WORDS = frozenset({"all", "paper"})  # that stand for a list of actuators


def options_of(settings: Sequence[str]) -> dict[str, Any]:
    """The options that the `--set` values name. InvalidPlan names every value that is none."""
    faults = [Fault(pointer="--set", message=f"{text!r} is not KEY=VALUE") for text in settings if not text.partition("=")[1]]
    if faults:
        raise InvalidPlan("the options cannot be read", faults=tuple(faults))
    pairs = (text.partition("=") for text in settings)
    return {key.strip(): _value(key.strip(), value.strip()) for key, _, value in pairs}


def owned_setting(file: Path) -> list[str]:
    """The `--set` value that the grippers in a file make: a list of specifications, or a design document."""
    try:
        content = json.loads(file.read_bytes())
        grippers = specifications(content) if isinstance(content, dict) else content
    except (OSError, ValueError, RecursionError) as error:
        raise InvalidInput("the owned grippers cannot be read", faults=(Fault(str(file), str(error)),)) from None
    except (KeyError, TypeError):
        fault = Fault(str(file), "neither a list of grippers nor a design.json")
        raise InvalidInput("the owned grippers cannot be read", faults=(fault,)) from None
    return [f"owned={json.dumps(grippers)}"]


def _value(key: str, text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        pass
    if key in _LISTS and text not in _WORDS:
        return [item.strip() for item in text.split(",") if item.strip()]
    return text
