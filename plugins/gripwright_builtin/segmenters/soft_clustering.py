"""Soft clustering of numbers: a Gaussian mixture, fitted to their weighted histogram. No randomness."""

from dataclasses import dataclass

import numpy as np

from gripwright.domain.shape import FloatArray

BINS = 512
STEPS_MAX = 60
TOLERANCE = 1e-5
SPREAD_MIN = 0.01
"""Smallest standard deviation of a cluster: differences below are noise of the rays."""
COMMON_SPREAD_MIN = 0.03


OBSERVATIONS = 200
"""Independent measurements that a surface stands for when the number of clusters is chosen: patches, not faces."""
COUNT_MAX = 8
"""Clusters among which the number is chosen."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Mixture:
    """Normal densities with their shares."""

    means: FloatArray  # (k,)
    spreads: FloatArray  # (k,)
    shares: FloatArray  # (k,)

    def logarithms(self, values: FloatArray) -> FloatArray:
        """Logarithm of each share times its density at each value, up to a constant, (m, k)."""
        return np.log(self.shares / self.spreads) - 0.5 * ((values[:, None] - self.means) / self.spreads) ** 2

    def responsibilities(self, values: FloatArray) -> FloatArray:
        """Bayes' rule, (m, k)."""
        log = self.logarithms(values)
        density = np.exp(log - log.max(axis=1, keepdims=True))
        return np.asarray(density / density.sum(axis=1, keepdims=True))


def cluster_probabilities(values: FloatArray, weights: FloatArray, count: int, common_spread: bool) -> FloatArray:
    """Probability of each value (m,) in 0..1 to belong to each of at most `count` clusters, (m, k); rows sum to 1.

    With a common spread no cluster can be so wide that it takes in what lies between and beside the others.
    """
    centres, mass = _histogram(values, weights)
    return _fitted(centres, mass, count, common_spread).responsibilities(values)


def cluster_count(values: FloatArray, weights: FloatArray, common_spread: bool) -> int:
    """The number of clusters, up to `COUNT_MAX`, that the Bayesian information criterion prefers (Schwarz, 1978).

    Each cluster has a mean and a share, and a spread where it is not common; likelihoods are those of `OBSERVATIONS` values.
    """
    centres, mass = _histogram(values, weights)
    criteria = []
    for count in range(1, min(COUNT_MAX, int((mass > 0).sum())) + 1):
        log = _fitted(centres, mass, count, common_spread).logarithms(centres)
        likelihood = float(mass @ np.logaddexp.reduce(log, axis=1))
        parameters = 2 * count if common_spread else 3 * count - 1
        criteria.append(parameters * np.log(OBSERVATIONS) - 2.0 * OBSERVATIONS * likelihood)
    return int(np.argmin(criteria)) + 1


def _histogram(values: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Middles of the bins and the share of the weight in each, (BINS,) both."""
    edges = np.linspace(0.0, 1.0, BINS + 1)
    mass = np.histogram(values, edges, weights=weights)[0]
    return (edges[1:] + edges[:-1]) / 2.0, mass / mass.sum()


def _fitted(centres: FloatArray, mass: FloatArray, count: int, common_spread: bool) -> _Mixture:
    """The mixture of at most `count` clusters that expectation maximisation reaches."""
    means, spreads, shares = _initial(centres, mass, count)
    if common_spread:
        spreads = _common(spreads, shares)
    for _ in range(STEPS_MAX):
        before = means
        mixture = _Mixture(means=means, spreads=spreads, shares=shares)
        belonging = mixture.responsibilities(centres) * mass[:, None]  # (bins, k)
        shares = np.maximum(belonging.sum(axis=0), 1e-12)
        means = belonging.T @ centres / shares
        variance = (belonging * (centres[:, None] - means) ** 2).sum(axis=0) / shares
        spreads = np.maximum(np.sqrt(variance), SPREAD_MIN)
        if common_spread:
            spreads = _common(spreads, shares)
        if np.abs(means - before).max() < TOLERANCE:
            break
    return _Mixture(means=means, spreads=spreads, shares=shares)


def _common(spreads: FloatArray, shares: FloatArray) -> FloatArray:
    """One spread for all clusters, (k,)."""
    return np.full_like(spreads, max(float(np.sqrt((shares * spreads**2).sum())), COMMON_SPREAD_MIN))


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
