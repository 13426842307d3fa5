"""What fingers are made of. Figures are the makers' minima at room temperature."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Material:
    """Density, Young's modulus and yield strength."""

    name: str
    density_kg_m3: float
    modulus_MPa: float
    strength_MPa: float


PA12 = Material(name="PA12 (laser-sintered)", density_kg_m3=930.0, modulus_MPa=1650.0, strength_MPa=48.0)  # EOS PA 2200
ALUMINIUM = Material(name="aluminium EN AW-6082-T6", density_kg_m3=2700.0, modulus_MPa=70_000.0, strength_MPa=250.0)  # EN 755-2
STEEL = Material(name="steel C45", density_kg_m3=7850.0, modulus_MPa=210_000.0, strength_MPa=370.0)  # EN ISO 683-1, normalised

BY_KEY: dict[str, tuple[Material, ...]] = {
    "auto": (PA12, ALUMINIUM, STEEL),  # the easiest to make that is stiff and strong enough
    "pa12": (PA12,),
    "aluminium": (ALUMINIUM,),
    "steel": (STEEL,),
}
