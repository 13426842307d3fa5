"""`gripwright serve` with workers of a calculation made for tests; everything else is real."""

import functools
import sys

from gripwright.cli import app, serve
from gripwright.jobs.supervisor import Supervisor

WORKER = (sys.executable, "-c", "import fake_worker; fake_worker.main()")


def main():
    serve.Supervisor = functools.partial(Supervisor, command=WORKER)
    sys.argv = ["gripwright", "serve", "--port", "0"]
    app()
