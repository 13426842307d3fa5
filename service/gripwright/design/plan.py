"""The plan of a design: which plug-ins, with which parameters, and the task-level options of INTERFACE.md."""

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from gripwright.domain.errors import Fault, InvalidPlan
