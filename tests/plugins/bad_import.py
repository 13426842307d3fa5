"""A plug-in that reaches into the service."""

from gripwright.design.plan import Plan
from gripwright.domain.errors import Rejection
from gripwright.plugin_api import Params


class ImportsTheService:
    key = "bad"
    params_model = Params

    def __init__(self, params):
        self._params = params

    def fit(self, component, segment, ctx):
        return Rejection("no", str(Plan))
