"""A plug-in that reaches into the service."""

from bad_plugins import Fitter

from gripwright.design.plan import Plan


class ImportsTheService(Fitter):
    plan = Plan
