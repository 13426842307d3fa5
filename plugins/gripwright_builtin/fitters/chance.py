"""How little likely it is that points lie so near to a surface by chance (a contrario). Compiled."""

import numpy as np
from numba import njit

from gripwright.domain.shape import FloatArray

EXACT = 1e-6
"""Share of the size: the rounding of CAD files."""
_ENOUGH = 300  # points tell the noise
_LOGARITHMS = np.log(np.maximum(np.arange(2 * _ENOUGH + 2), 1))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def likely(far: FloatArray, band: float, free: int) -> tuple[float, float]:
    """The distance within which the points are least likely so many by chance, and how little: minus the logarithm.

    `far` are the points' distances, by chance uniform within `band`; `free` numbers decide the surface, so that as many
    points lie on it anyway. The number of false alarms is C(n, k) (d / band)^(k − free). Unlike a median this needs no
    majority, and for noise it is about two standard deviations whatever else is near.
    """
    every = len(far) // _ENOUGH + 1
    ordered = np.sort(far[::every])
    count = int(np.searchsorted(ordered, band))
    best, most, ways = band, 0.0, 0.0
    for k in range(1, count + 1):
        ways += _LOGARITHMS[count - k + 1] - _LOGARITHMS[k]
        if k > free:
            value = (k - free) * np.log(band / max(ordered[k - 1], EXACT)) - ways
            if value > most:
                best, most = ordered[k - 1], value
    return max(best, EXACT), most * every
