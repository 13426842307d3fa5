"""`python -m gripwright.registry.describe '{"allow": null, "strict": false}'` prints what is installed as one line of JSON.

Before it a line for each distribution, so that whoever reads knows which one was loaded when the process ended.
"""

import json
import sys

from gripwright.registry.description import LOADING, describe
from gripwright.registry.discovery import load_registry


def main(request: str) -> None:
    """Print the description of the registry."""
    registry = load_registry(**json.loads(request), on_load=lambda distribution: _print(f"{LOADING}{distribution}"))
    _print(json.dumps(describe(registry)))


def _print(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1])
