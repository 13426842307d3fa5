"""A component in colours: by segment, or by a value a face such as the shape diameter."""

import numpy as np

from gripwright.cad.glb import GlbPart, glb_bytes
from gripwright.domain.shape import FloatArray, IntArray, Mesh

_STEPS = 31
_GOLDEN_ANGLE = 0.38196601125  # of a full turn: neighbouring segment numbers get distant hues
# Perceptually even from dark violet over teal to yellow; sRGB.
_SCALE = np.array(
    [[0.27, 0.00, 0.33], [0.23, 0.32, 0.55], [0.13, 0.57, 0.55], [0.37, 0.79, 0.38], [0.99, 0.91, 0.14]], dtype=np.float64
)


def component_glb(name: str, mesh: Mesh, face_colours: FloatArray | None = None) -> bytes:
    """A component's mesh as .glb, grey or with the given linear colours (m, 3) of its faces."""
    return glb_bytes([GlbPart(name=name, mesh=mesh, face_colours=face_colours)])


def segment_colours(labels: IntArray) -> FloatArray:
    """A colour (m, 3) for each face by its segment number (m,); a number has the same colour in every component."""
    hue = (labels * _GOLDEN_ANGLE) % 1.0  # (m,)
    lightness = np.where(labels % 2 == 0, 0.95, 0.72)
    channel = (np.array([5.0, 3.0, 1.0]) + hue[:, None] * 6.0) % 6.0  # (m, 3)
    weight = np.clip(np.minimum(channel, 4.0 - channel), 0.0, 1.0)
    return _linear(lightness[:, None] * (1.0 - 0.62 * weight))


def value_colours(values: FloatArray) -> FloatArray:
    """A colour (m, 3) for each face by its value (m,), dark for the least and bright for the largest; NaN is black."""
    finite = np.isfinite(values)
    low, high = (float(values[finite].min()), float(values[finite].max())) if finite.any() else (0.0, 1.0)
    position = np.clip((values - low) / max(high - low, np.finfo(np.float64).tiny), 0.0, 1.0)  # (m,)
    position = np.round(position * _STEPS) / _STEPS  # few colours: neighbouring faces share vertices
    stops = np.linspace(0.0, 1.0, len(_SCALE))
    colours = np.stack([np.interp(position, stops, _SCALE[:, channel]) for channel in range(3)], axis=1)
    return _linear(np.where(finite[:, None], colours, 0.0))


def _linear(srgb: FloatArray) -> FloatArray:
    """Linear values of sRGB ones, as glTF's colours are."""
    return np.asarray(np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4))
