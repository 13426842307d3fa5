"""A primitive for the conformance checks, which have none of it. Lengths in mm."""

from collections.abc import Sequence

import numpy as np

from gripwright.domain.shape import Box, Primitive


def square_boxes() -> Sequence[Primitive]:
    """One of square section, as four fingers hold it."""
    return [Box(X_CB=np.eye(4), extents_mm=np.array([20.0, 20.0, 30.0]), filled=np.ones(6), filled_min=0.5, rms_mm=0.0)]
