"""`python -m gripwright.cli`: the command line where its script is not on the path."""

from gripwright.cli import app

app()
