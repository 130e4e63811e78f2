"""What is taken for samples, and what is refused, in words."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.rbf.sample_checks import numbers, samples

X, Y = np.zeros((4, 2)), np.ones((4, 3))


def test_lists_and_whole_numbers_are_taken():
    x, y, w, slopes, s = samples([[1, 2], [3, 4]], np.array([[1], [2]], np.int32), [1, 2])
    assert all(a.dtype == np.float64 for a in (x, y, w, s))
    np.testing.assert_array_equal(x, [[1, 2], [3, 4]])
    np.testing.assert_array_equal(w, [1, 2])
    assert slopes is None
    assert not s.any()


def test_what_counts_for_nothing_may_be_missing():
    x = X.copy()
    x[0] = np.nan
    slopes = np.zeros((4, 3, 2))
    slopes[:2] = np.nan
    taken = samples(x, Y, [0, 1, 1, 1], slopes, slope_weight=[1, 0, 1, 1])
    np.testing.assert_array_equal(taken[3], slopes)
    np.testing.assert_array_equal(taken[4], [1, 0, 1, 1])
    with pytest.raises(UsageError, match="Slopes hold"):
        samples(x, Y, [0, 1, 1, 1], slopes)
    with pytest.raises(UsageError, match="Inputs X hold"):
        samples(x, Y)


@pytest.mark.parametrize(
    ("bad", "text"),
    [
        ({"Y": np.zeros(4)}, "shape"),
        ({"X": np.zeros(4)}, "shape"),
        ({"X": np.zeros((0, 2)), "Y": np.zeros((0, 3))}, "shape"),
        ({"Y": np.zeros((4, 0))}, "shape"),
        ({"Y": np.zeros((3, 3))}, "4 rows of inputs"),
        ({"X": [["a", "b"]] * 4}, "array of"),
        ({"X": X + 1j}, "complex128"),
        ({"X": [[1, 2], [3]]}, "no array"),
        ({"Y": None}, "shape"),
        ({"Y": np.full((4, 3), np.inf)}, "Outputs Y hold"),
        ({"weights": np.ones(3)}, "Weights"),
        ({"weights": -np.ones(4)}, "negative"),
        ({"weights": np.zeros(4)}, "positive"),
        ({"weights": np.full(4, np.nan)}, "not finite"),
        ({"slopes": np.zeros((4, 2, 3))}, "Slopes have shape"),
        ({"slopes": np.zeros((4, 3, 2)), "slope_weight": -1.0}, "negative"),
        ({"inputs": 3}, r"\(any, 3\)"),
        ({"outputs": 2}, r"\(any, 2\)"),
        ({"fewest": 5}, "5 are needed"),
    ],
)
def test_what_is_no_samples_is_refused_with_a_way_out(bad, text):
    with pytest.raises(UsageError, match=text) as caught:
        samples(**({"X": X, "Y": Y} | bad))
    assert caught.value.why
    assert caught.value.fix


def test_a_vector_needs_its_length():
    with pytest.raises(UsageError, match=r"\(3,\)"):
        numbers("Noise", np.ones(2), (3,))
