"""Runs the scripts of a folder one after the other, each in a process of its own: what `make bench` and `make soak` do."""

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path

TESTS = Path(__file__).resolve().parent


def run_scripts(about: str, scripts: Mapping[str, Path], needs: Mapping[str, tuple[Path, ...]]) -> int:
    """Those that the command line names, or all; one that lacks what it needs is named and left out. The number that failed."""
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("names", nargs="*", metavar="name", help=f"one of {', '.join(scripts)}; all if none is given")
    names = parser.parse_args().names
    unknown = sorted(set(names) - set(scripts))
    if unknown:
        parser.error(f"nothing here is called {unknown[0]!r}; there are {', '.join(scripts)}")
    failed = []
    for name in names or scripts:
        print(f"== {name}", flush=True)
        missing = [path for path in needs.get(name, ()) if not path.exists()]
        if missing:
            print(f"left out: {os.path.relpath(missing[0], TESTS.parent)}, which it needs, is not there", flush=True)
            continue
        began_s = time.monotonic()
        code = subprocess.run([sys.executable, str(scripts[name])], check=False).returncode
        print(f"{name}: {'passed' if code == 0 else f'exit {code}'} after {time.monotonic() - began_s:.0f} s", flush=True)
        failed += [name] * (code != 0)
    print(f"failed: {', '.join(failed)}" if failed else "all passed", flush=True)
    return len(failed)
