"""Imported by the server that the children of a command are forked from: what compiles there is told on standard error."""

import sys

from gripwright.cli.compiling import tell_compiling

tell_compiling(lambda message: print(message, file=sys.stderr, flush=True))
