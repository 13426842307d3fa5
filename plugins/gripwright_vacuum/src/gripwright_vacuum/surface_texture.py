"""What a surface's texture costs, as a factor on the force: parameters that both holding models have alike."""

from pydantic import Field

from gripwright.domain.assembly import Component, Texture
from gripwright.plugin_api import Params


class TextureSettings(Params):
    """Factors on the force that is needed, by the texture of the component's surface."""

    smooth: float = Field(1.0, ge=1, le=20, description="on ground and polished surfaces")
    machined: float = Field(1.15, ge=1, le=20, description="on turned, milled and moulded surfaces")
    rough: float = Field(1.5, ge=1, le=20, description="on cast and sawn surfaces")
    porous: float = Field(3.0, ge=1, le=20, description="on sintered, foamed and wooden surfaces")
    unknown: Texture = Field("machined", description="what a surface counts as of which the product does not say it")

    def factor(self, component: Component) -> float:
        """The factor of a component's surface."""
        found: float = getattr(self, component.texture or self.unknown)
        return found
