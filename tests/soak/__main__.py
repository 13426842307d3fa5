"""Runs the long tests beside this file, or those named: `python -m tests.soak [load] [fault_matrix]`. All take an hour or two."""

import sys
from pathlib import Path

from tests.run_scripts import run_scripts

SCRIPTS = {path.stem: path for path in sorted(Path(__file__).resolve().parent.glob("*.py")) if not path.stem.startswith("_")}

if __name__ == "__main__":
    sys.exit(run_scripts(__doc__ or "", SCRIPTS, {}))
