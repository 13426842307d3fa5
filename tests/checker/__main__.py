"""`python -m checker DESIGN_FOLDER PACKAGE [RELEASE_CLEARANCE]`, from the folder `tests`: one line a fault, exit 1 if any."""

import sys
from pathlib import Path

from checker.promises import check_design

if __name__ == "__main__":
    clearance = float(sys.argv[3]) if len(sys.argv) > 3 else 1.0
    faults = check_design(Path(sys.argv[1]), Path(sys.argv[2]), release_clearance=clearance)
    print("\n".join(map(str, faults)) or "every promise holds")
    sys.exit(bool(faults))
