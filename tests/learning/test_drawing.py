"""The picture of a history shows the history, and leaves nothing behind."""

from __future__ import annotations

import io
import subprocess
import sys

import numpy as np
import pytest
from matplotlib.figure import Figure

from palpate.learning import History


def history(T=60, heldout=True):
    t = np.arange(1, T + 1)
    grew, pruned = (t % 10 == 1).astype(int), (t == 45).astype(int)
    fall = np.exp(-t / 10.0)
    error = np.where(t == 4, 0.0, fall)
    return History(
        np.cumsum(grew - pruned),
        error,
        error,
        fall / 2,
        grew,
        pruned,
        fall / 3 if heldout else np.zeros(0),
        2,
    )


def lines(axes):
    return {line.get_label(): line.get_xydata() for line in axes.get_lines()}


def test_picture_shows_the_history():
    h = history()
    errors, units = h.plot().axes
    at = np.arange(1, 61)
    drawn = lines(errors)
    np.testing.assert_array_equal(drawn["held out, of full scale"], np.column_stack([at, h.heldout]))
    shown = drawn["error before the update"][:, 1]
    assert np.isnan(shown[3])  # zero has no place on a logarithmic axis
    np.testing.assert_array_equal(np.delete(shown, 3), np.delete(h.error, 3))
    assert errors.get_yscale() == "log"
    marks = {line.get_marker(): line.get_xydata() for line in units.get_lines()}
    np.testing.assert_array_equal(marks["^"][:, 0], at[h.grew > 0])
    np.testing.assert_array_equal(marks["v"], [[45, h.units[44]]])
    low, high = units.get_ylim()
    assert low == 0
    assert high > h.units.max()


def test_picture_in_axes_of_ones_own():
    own = Figure()
    axes = own.subplots()
    assert history().plot(axes) is own
    assert [a.get_ylabel() for a in own.axes] == ["error", "units"]


@pytest.mark.full
@pytest.mark.parametrize(
    "h", [history(0), history(1), history(heldout=False)], ids=["empty", "one", "not held out"]
)
def test_picture_of_little(h):
    file = io.BytesIO()
    h.plot().savefig(file, format="svg")
    assert file.getvalue().endswith(b"</svg>\n")


@pytest.mark.full
def test_no_window_system_is_asked_for():
    probe = (
        "import numpy as np, sys\nfrom palpate.learning import History\n"
        "z = np.zeros(0)\nHistory(z, z, z, z, z, z, z, 0).plot()\n"
        "print('matplotlib.pyplot' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
