"""A component in sRGB colours: by segment, or by a value a face such as the shape diameter."""

import numpy as np

from gripwright.cad.glb import GlbPart, glb_bytes
from gripwright.domain.shape import FloatArray, IntArray, Mesh

_STEPS = 31
# Perceptually even from dark violet over teal to yellow; sRGB.
_SCALE = np.array(
    [[0.27, 0.00, 0.33], [0.23, 0.32, 0.55], [0.13, 0.57, 0.55], [0.37, 0.79, 0.38], [0.99, 0.91, 0.14]], dtype=np.float64
)

PALETTE = np.array(
    [
        [0.90, 0.62, 0.00], [0.34, 0.71, 0.91], [0.00, 0.62, 0.45], [0.94, 0.89, 0.26],
        [0.00, 0.45, 0.70], [0.84, 0.37, 0.00], [0.80, 0.47, 0.65], [0.55, 0.55, 0.55],
    ]
)  # fmt: skip
"""Okabe and Ito's colours, told apart by colour-blind readers too."""


def component_glb(name: str, mesh: Mesh, face_colours: FloatArray | None = None) -> bytes:
    """A component's mesh as .glb, grey or with the given sRGB colours (m, 3) of its faces."""
    linear = None if face_colours is None else linear_colours(face_colours)
    return glb_bytes([GlbPart(name=name, mesh=mesh, face_colours=linear)])


def segment_colours(labels: IntArray) -> FloatArray:
    """A colour (m, 3) for each face by its segment number (m,); neighbours in number differ."""
    shade = 1.0 - 0.18 * ((labels // len(PALETTE)) % 5)  # (m,)
    return np.asarray(PALETTE[labels % len(PALETTE)] * shade[:, None])


def value_colours(values: FloatArray) -> FloatArray:
    """A colour (m, 3) for each face by its value (m,), dark for the least and bright for the largest; NaN is black."""
    finite = np.isfinite(values)
    low, high = (float(values[finite].min()), float(values[finite].max())) if finite.any() else (0.0, 1.0)
    position = np.clip((values - low) / max(high - low, np.finfo(np.float64).tiny), 0.0, 1.0)  # (m,)
    position = np.round(position * _STEPS) / _STEPS  # few colours: neighbouring faces share vertices
    stops = np.linspace(0.0, 1.0, len(_SCALE))
    colours = np.stack([np.interp(position, stops, _SCALE[:, channel]) for channel in range(3)], axis=1)
    return np.where(finite[:, None], colours, 0.0)


def linear_colours(srgb: FloatArray) -> FloatArray:
    """Linear values of sRGB ones, as glTF's colours are."""
    return np.asarray(np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4))
