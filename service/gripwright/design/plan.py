"""The plan of a design: which plug-ins, with which parameters, and the task-level options of INTERFACE.md."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from gripwright.domain.errors import Fault, InvalidPlan
from gripwright.domain.grasp import EXTERNAL, PARALLEL_2
from gripwright.domain.pad import Pad, RubberKey

BEST, BEST_OF = "best", ("sdf", "primitives")
"""`segmenter=best` runs these; where they explain alike, the first is kept."""

_PAD = "pad"  # a field with fields of its own, given as those of a plug-in are

Length = Annotated[float, Field(ge=0, le=1e4)]


class OwnedGripper(BaseModel):
    """A gripper that is at hand. Lengths in mm."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    name: str = Field(min_length=1, max_length=200)
    gripper_type: str = Field(min_length=1, max_length=200)
    grip: Literal["external", "internal", "surface"] = "external"
    opening_min: Length
    opening_max: Length
    finger_length: Length
    actuator: str | None = Field(None, description="maker/model in the catalogue; null: of unknown force and default size")
    palm_radius: Length | None = Field(None, description="of all that is behind the fingers; null: by default")
    taper: float = Field(0.0, ge=-45, le=45, description="degrees, of tapered tips; positive: they converge towards their ends")
    v_angle: float | None = Field(None, ge=60, lt=180, description="degrees between the flanks of V tips; null: they have no V")
    v_depth: float | None = Field(None, gt=0, le=50, description="mm, of the V of V tips; null: they have none")

    @model_validator(mode="after")
    def _opens(self) -> "OwnedGripper":
        if self.opening_max < self.opening_min:
            raise ValueError(f"opening_max {self.opening_max:g} is less than opening_min {self.opening_min:g}")
        if self.taper and self.grip == "internal":
            raise ValueError(f"taper {self.taper:g} for an internal grip: tapered tips hold from outside")
        if (self.v_angle is None) != (self.v_depth is None):
            raise ValueError("of V tips both v_angle and v_depth are given")
        if self.v_angle is not None and (self.grip, self.gripper_type) != (EXTERNAL, PARALLEL_2):
            raise ValueError(f"V tips are of {PARALLEL_2} and hold from outside")
        return self


class PadOptions(BaseModel):
    """The soft pad of the fingertips, in fingers and in what holds alike."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    thickness: float = Field(1.0, gt=0, le=5, description="mm")
    hardness: float = Field(70.0, ge=30, le=95, description="Shore A")
    rubber: RubberKey = Field("nbr", description="what it is cut from")

    @property
    def made(self) -> Pad:
        """The pad of these options."""
        return Pad(thickness_mm=self.thickness, hardness_shore_A=self.hardness, rubber=self.rubber)


class Plan(BaseModel):
    """A checked plan. `params` holds the parameters of each plug-in under its key; the registry checks them."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    plan: Literal["default", "paper"] = Field("default", description="'paper': the paper's own method and no more")
    segmenter: str = Field(
        "sdf", description=f"key of the segmenter; '{BEST}': of {' and '.join(BEST_OF)} the one whose primitives explain more"
    )
    fitters: tuple[str, ...] = Field(("cylinder", "box"), min_length=1, description="keys of the primitive fitters that compete")
    affordance: tuple[str, ...] = Field(("marked", "threads", "teeth"), description="keys of the affordance detectors")
    rules: tuple[str, ...] = Field(
        ("three_finger_cylinder", "two_finger_box", "three_finger_bore"),
        min_length=1,
        description="keys of the gripper rules, preferred first",
    )
    hands: tuple[str, ...] = Field(("centric_3", "parallel_2"), min_length=1, description="keys of the hand models")
    planners: tuple[str, ...] = Field(("axial", "facet_pairs"), min_length=1, description="keys of the grasp planners")
    optimizer: str = Field("set_cover", description="key of the gripper-set optimiser")
    holding: tuple[str, ...] = Field((), description="keys of the holding models, of gripper types that close no jaws")
    finger: str | tuple[str, ...] = Field(
        "straight", description="key of the finger designer, or of several for different gripper types"
    )
    policies: tuple[str, ...] = Field((), description="keys of the house's policies: they forbid and prefer grips and actuators")
    actuators: Literal["all", "paper"] | tuple[str, ...] = Field(
        "all", description="the catalogue, the paper's two air chucks, or a list of maker/model"
    )
    pad: PadOptions = Field(PadOptions(), description="the soft pad of the fingertips: pad.thickness, pad.hardness, pad.rubber")
    owned: tuple[OwnedGripper, ...] = Field((), description="grippers that are at hand: they are used before new ones")
    release_clearance: float = Field(1.0, ge=0, le=50, description="mm that the opening grows to let go")
    finger_length_step: float = Field(5.0, ge=0, le=100, description="mm, finger lengths are rounded up to it")
    safety_factor: float = Field(2.0, ge=1, le=20, description="on the grip force that friction needs")
    min_contact: float = Field(3.0, gt=0, le=100, description="mm, least contact height")
    margin: float = Field(0.1, ge=0, le=20, description="mm, least clearance to anything that is not gripped")
    contact_tolerance: float = Field(0.1, ge=0, le=5, description="mm of overlap of the motion itself that is contact")
    finest_rotation: float = Field(
        1.9, gt=0, le=180, description="degrees between grasps at the finest, where none of the planned ones is free"
    )
    finest_step: float = Field(0.65, gt=0, le=100, description="mm between grasps at the finest")
    seed: int = Field(0, ge=0, description="of everything that is random")
    params: dict[str, dict[str, Any]] = Field(default_factory=dict, description="plug-in key → parameters")

    @field_validator("finger")
    @classmethod
    def _one_by_its_key(cls, finger: str | tuple[str, ...]) -> str | tuple[str, ...]:
        keys = tuple(key.strip() for key in (finger.split(",") if isinstance(finger, str) else finger) if key.strip())
        if not keys:
            raise ValueError("no finger designer is named")
        return keys[0] if len(keys) == 1 else keys

    @field_validator("owned")
    @classmethod
    def _named_apart(cls, owned: tuple[OwnedGripper, ...]) -> tuple[OwnedGripper, ...]:
        names = [gripper.name for gripper in owned]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"two owned grippers have the name {twice[0]!r}")
        return owned

    @property
    def segmenters(self) -> tuple[str, ...]:
        """Keys of the segmenters that are run; of several, the better answer is kept for each component."""
        return BEST_OF if self.segmenter == BEST else (self.segmenter,)

    @property
    def enforce_hold(self) -> bool:
        """Whether an actuator too weak, or of unknown force, is vetoed; the paper's plan asks nothing of the force."""
        return self.plan != "paper"


def without_effect(plan: Plan, asked: Iterable[str]) -> list[str]:
    """A sentence for each parameter that nothing reads, since its plug-in is not among those asked ("kind/key")."""
    keys = {name.partition("/")[2] for name in asked}
    unread = [(key, name) for key, params in plan.params.items() if key not in keys for name in params]
    return [f"{key}.{name} has no effect: the plan does not ask {key!r}" for key, name in unread]


def plan_of(options: Mapping[str, Any]) -> Plan:
    """The plan of options as given: `{"sdf.rays": 20}` or `{"sdf": {"rays": 20}}`; InvalidPlan names every fault."""
    fields: dict[str, Any] = {}
    params: dict[str, dict[str, Any]] = {}
    for key, value in options.items():
        if key in Plan.model_fields and key not in ("params", _PAD):
            fields[key] = value
        elif isinstance(value, Mapping):
            params.setdefault(key, {}).update(value)
        else:
            plugin, dot, name = key.partition(".")
            if not dot:
                params[key] = {}
                fields[key] = value  # pydantic reports the unknown option
            else:
                params.setdefault(plugin, {})[name] = value
    if _PAD in params:
        fields.setdefault(_PAD, params.pop(_PAD))
    try:
        return Plan(**fields, params=params)
    except ValidationError as error:
        faults = tuple(
            Fault(
                pointer="/options/" + "/".join(str(part) for part in fault["loc"]), message=_message(fault["type"], fault["msg"])
            )
            for fault in error.errors()
        )
        raise InvalidPlan("the options are not a plan", faults=faults) from None


_MESSAGES: Mapping[str, str] = MappingProxyType(
    {"extra_forbidden": "there is no such option", "tuple_type": "a list is expected"}
)
"""What pydantic says of Python, said of options."""


def _message(kind: str, message: str) -> str:
    return _MESSAGES.get(kind, message)
