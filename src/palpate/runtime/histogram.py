"""A histogram of durations in logarithmic bins: constant memory, no allocation per sample, 1 µs to 1 s.

Bin 0 counts what is below 1 µs, the last bin what is 1 s or more; the 62 between are equal in log t, so that
neighbouring edges differ by a factor 10^(6/62) = 1.25 and a percentile is right to within that factor.
"""

from __future__ import annotations

import math

import numpy as np

__all__ = ["BINS", "EDGES", "Histogram", "percentile"]

BINS = 64
_LOW, _DECADES = 1e-6, 6.0  # s, from 1 µs to 1 s
_PER_DECADE = (BINS - 2) / _DECADES

EDGES = _LOW * 10.0 ** (np.arange(BINS - 1) / _PER_DECADE)  # (63,) s: bin k holds EDGES[k-1] ≤ t < EDGES[k]


class Histogram:
    """Counts durations into an array it is given, for example a field of the shared state.

    Parameters
    ----------
    counts : (64,) int64
    """

    def __init__(self, counts: np.ndarray) -> None:
        self.counts = counts
        self.maximum = 0.0  # s

    def add(self, duration: float) -> None:
        """Count one duration, s."""
        self.maximum = max(self.maximum, duration)
        if duration < _LOW:
            self.counts[0] += 1
        else:
            self.counts[min(BINS - 1, 1 + int(math.log10(duration / _LOW) * _PER_DECADE))] += 1


def percentile(counts: np.ndarray, share: float) -> float:
    """The duration that `share` of the samples stay below.

    Parameters
    ----------
    counts : (64,) int64
    share : float
        0 … 1.

    Returns
    -------
    float
        s, interpolated in log t inside its bin; 0 where nothing was counted or it lies below 1 µs, 1 s where
        it lies above.
    """
    total = int(counts.sum())
    if total == 0:
        return 0.0
    below = np.cumsum(counts)
    wanted = max(share * total, 1e-9)
    k = int(np.searchsorted(below, wanted))
    if k == 0:
        return 0.0
    if k >= BINS - 1:
        return float(EDGES[-1])
    inside = (wanted - below[k - 1]) / counts[k]
    return float(EDGES[k - 1] * 10.0 ** (inside / _PER_DECADE))
