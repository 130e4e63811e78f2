"""Percentiles from logarithmic bins, against the exact ones of the same samples."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.runtime.loop_report import BINS, EDGES, Histogram, percentile


@pytest.mark.parametrize("scale", [3e-6, 2e-4, 5e-3])
def test_percentiles_are_right_to_a_bin(scale):
    samples = np.random.default_rng(1).lognormal(np.log(scale), 0.8, 5000)
    histogram = Histogram(np.zeros(BINS, np.int64))
    for sample in samples:
        histogram.add(float(sample))
    width = EDGES[1] / EDGES[0]
    for share in (0.1, 0.5, 0.99):
        exact = max(np.quantile(samples, share), EDGES[0])
        assert 1 / width <= max(percentile(histogram.counts, share), EDGES[0]) / exact <= width
    assert histogram.maximum == samples.max()
    assert histogram.counts.sum() == samples.size


def test_every_duration_has_its_bin():
    inside = np.sqrt(EDGES[1:] * EDGES[:-1])
    for k, duration in enumerate([1e-9, *inside, 5.0]):
        histogram = Histogram(np.zeros(BINS, np.int64))
        histogram.add(float(duration))
        assert histogram.counts[k] == 1
    assert EDGES[0] == pytest.approx(1e-6)
    assert EDGES[-1] == pytest.approx(1.0)


def test_ends():
    counts = np.zeros(BINS, np.int64)
    assert percentile(counts, 0.5) == 0.0
    counts[0] = 10
    assert percentile(counts, 0.99) == 0.0
    counts[-1] = 1000
    assert percentile(counts, 0.99) == pytest.approx(1.0)
