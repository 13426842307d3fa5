"""Parameters of plug-ins: data with a JSON Schema."""

from pydantic import BaseModel, ConfigDict


class Params(BaseModel):
    """Base of every `params_model`: frozen, no unknown keys; each field has a default, a range and a description with unit."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
