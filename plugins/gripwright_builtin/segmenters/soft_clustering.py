"""Soft clustering of numbers: a Gaussian mixture, fitted to their weighted histogram. No randomness."""

import numpy as np

from gripwright.domain.shape import FloatArray

BINS = 512
STEPS_MAX = 60
TOLERANCE = 1e-5
SPREAD_MIN = 0.01
"""Smallest standard deviation of a cluster: differences below are noise of the rays."""
COMMON_SPREAD_MIN = 0.03


def cluster_probabilities(values: FloatArray, weights: FloatArray, count: int, common_spread: bool) -> FloatArray:
    """Probability of each value (m,) in 0..1 to belong to each of at most `count` clusters, (m, k); rows sum to 1.

    With a common spread no cluster can be so wide that it takes in what lies between and beside the others.
    """
    edges = np.linspace(0.0, 1.0, BINS + 1)
    centres = (edges[1:] + edges[:-1]) / 2.0
    mass = np.histogram(values, edges, weights=weights)[0]
    mass = mass / mass.sum()
    means, spreads, shares = _initial(centres, mass, count)
    if common_spread:
        spreads = _common(spreads, shares)
    for _ in range(STEPS_MAX):
        before = means
        belonging = _responsibilities(centres, means, spreads, shares) * mass[:, None]  # (bins, k)
        shares = np.maximum(belonging.sum(axis=0), 1e-12)
        means = belonging.T @ centres / shares
        variance = (belonging * (centres[:, None] - means) ** 2).sum(axis=0) / shares
        spreads = np.maximum(np.sqrt(variance), SPREAD_MIN)
        if common_spread:
            spreads = _common(spreads, shares)
        if np.abs(means - before).max() < TOLERANCE:
            break
    return _responsibilities(values, means, spreads, shares)


def _common(spreads: FloatArray, shares: FloatArray) -> FloatArray:
    """One spread for all clusters, (k,)."""
    return np.full_like(spreads, max(float(np.sqrt((shares * spreads**2).sum())), COMMON_SPREAD_MIN))


def _responsibilities(values: FloatArray, means: FloatArray, spreads: FloatArray, shares: FloatArray) -> FloatArray:
    """Bayes' rule for normal densities, (m, k)."""
    log = np.log(shares / spreads) - 0.5 * ((values[:, None] - means) / spreads) ** 2  # (m, k)
    density = np.exp(log - log.max(axis=1, keepdims=True))
    return np.asarray(density / density.sum(axis=1, keepdims=True))


def _initial(centres: FloatArray, mass: FloatArray, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean, spread and share of the clusters of least squared distance: k-means in one dimension, solved exactly.

    Dynamic programme over the filled bins; with no more filled bins than clusters, each bin is a cluster.
    """
    filled = np.flatnonzero(mass > 0)
    x, w = centres[filled], mass[filled]
    n, count = len(x), min(count, len(x))
    sums = np.concatenate((np.zeros((1, 3)), np.cumsum(np.stack((w, w * x, w * x * x), axis=1), axis=0)))
    total = sums[None, 1:] - sums[:-1, None]  # (first bin, last bin, 3): sums over a run of bins
    with np.errstate(divide="ignore", invalid="ignore"):
        cost = np.where(np.tri(n, k=-1, dtype=bool), np.inf, total[..., 2] - total[..., 1] ** 2 / total[..., 0])
    best, cuts = cost[0], []
    for _ in range(count - 1):
        options = np.concatenate(([np.inf], best[:-1]))[:, None] + cost  # best up to the bin before, then one run
        cuts.append(options.argmin(axis=0))
        best = options.min(axis=0)
    ends = [n]
    for cut in reversed(cuts):
        ends.append(int(cut[ends[-1] - 1]))
    ends.append(0)
    runs = sums[ends[-2::-1]] - sums[ends[:0:-1]]  # (k, 3)
    shares, means = runs[:, 0], runs[:, 1] / runs[:, 0]
    return means, np.maximum(np.sqrt(np.maximum(runs[:, 2] / shares - means**2, 0.0)), SPREAD_MIN), shares
