"""The soft pad of a fingertip: what the holding model reckons with, and what is made and bonded. Lengths in mm."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

RubberKey = Literal["nbr", "silicone", "polyurethane"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Rubber:
    """What pads are cut from. The density is a common value at 70 Shore A; `adhesive` bonds it to metal and PA12."""

    name: str
    density_kg_m3: float
    adhesive: str


RUBBERS: Mapping[RubberKey, Rubber] = MappingProxyType(
    {
        "nbr": Rubber(name="NBR", density_kg_m3=1300.0, adhesive="rubber-toughened cyanoacrylate"),
        "silicone": Rubber(name="silicone rubber", density_kg_m3=1200.0, adhesive="RTV silicone on its primer"),
        "polyurethane": Rubber(name="polyurethane", density_kg_m3=1200.0, adhesive="two-component polyurethane adhesive"),
    }
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Pad:
    """A thin layer of rubber, bonded to the finger over its whole gripping surface."""

    thickness_mm: float = 1.0
    hardness_shore_A: float = 70.0
    rubber: RubberKey = "nbr"
    poisson: float = 0.45
    compression: float = 0.2  # of the thickness, that it bears for long

    @property
    def material(self) -> str:
        """As bills and drawings name it."""
        return f"{RUBBERS[self.rubber].name} {self.hardness_shore_A:g} Shore A"

    @property
    def modulus_MPa(self) -> float:
        """Young's modulus from the hardness (Gent, On the relation between indentation hardness and Young's modulus, 1958)."""
        hardness = self.hardness_shore_A
        return 0.0981 * (56.0 + 7.62336 * hardness) / (0.137505 * (254.0 - 2.54 * hardness))

    @property
    def normal_N_mm3(self) -> float:
        """Pressure by indentation of a layer that cannot give sideways."""
        nu = self.poisson
        return self.modulus_MPa * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu)) / self.thickness_mm

    @property
    def shear_N_mm3(self) -> float:
        """Shear stress by tangential displacement."""
        return self.modulus_MPa / (2.0 * (1.0 + self.poisson)) / self.thickness_mm


PAD = Pad()
