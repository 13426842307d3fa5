"""`python -m gripwright.registry.describe '{"allow": null, "strict": false}'` prints what is installed as one line of JSON."""

import json
import sys

from gripwright.registry.description import describe
from gripwright.registry.discovery import load_registry


def main(request: str) -> None:
    """Print the description of the registry."""
    sys.stdout.write(json.dumps(describe(load_registry(**json.loads(request)))) + "\n")


if __name__ == "__main__":
    main(sys.argv[1])
