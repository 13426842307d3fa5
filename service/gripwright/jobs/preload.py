"""Imported by the server that children are forked from, and by nothing else: everything heavy, once."""

import signal

from gripwright.jobs.installed import installed_registry
from gripwright.jobs.steps import STAGES_AT, load_stages
from gripwright.settings import load_settings

# A service manager that stops everything at once must not make a running step look crashed: the worker decides.
signal.signal(signal.SIGTERM, signal.SIG_IGN)

installed_registry(load_settings().plugins_allow)
load_stages(STAGES_AT)
