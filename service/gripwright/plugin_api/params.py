"""Parameters of plug-ins: data with a JSON Schema."""

from pydantic import BaseModel, ConfigDict


class Params(BaseModel):
    """Base of every `params_model`: frozen, no unknown keys. Each field has a default, a range and a description with its unit."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
