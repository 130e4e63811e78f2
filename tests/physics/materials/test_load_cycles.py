"""Loadings and unloadings of a deformation, counted whatever the sign, the noise and the way back."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.physics.materials.load_cycles import load_runs, rows_of_cycle

UP = np.linspace(0.0, 1.0, 30)
CYCLE = np.concatenate([UP, UP[::-1]])


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("noise", [0.0, 0.01])
@pytest.mark.parametrize("hold", [0, 40])
def test_cycles_are_counted(sign, noise, hold):
    parts = [np.concatenate([UP, np.full(hold, 1.0), UP[::-1]]) for _ in range(3)]
    x = sign * np.concatenate([*parts, np.zeros(hold)])
    runs = load_runs(x + noise * np.random.default_rng(0).normal(size=len(x)))
    assert [run.loads for run in runs] == 3 * [True, False]
    assert {run.sign for run in runs} == {sign}
    for k, run in enumerate(r for r in runs if r.loads):
        assert abs(run.last - (60 + hold) * k - 29) <= 2 + hold * (noise > 0)


def test_ways_back_without_rows_are_none():
    runs = load_runs(np.tile(UP, 3))
    assert [(run.first, run.last, run.loads) for run in runs] == [
        (0, 29, True),
        (30, 59, True),
        (60, 89, True),
    ]


def test_tension_and_compression_are_counted_apart():
    x = np.sin(np.linspace(0, 4 * np.pi, 400))
    rows, said = rows_of_cycle(x, None)
    assert "2 loadings and 2 unloadings" in said
    turn = x[rows[np.flatnonzero(np.diff(rows) > 1)]]
    assert turn == pytest.approx(1.0, abs=1e-3)  # the first way to either side
    assert x[rows].min() == pytest.approx(-1.0, abs=1e-3)
    both = np.concatenate([UP, -UP])  # two branches one below the other are no cycle
    assert len(rows_of_cycle(both, None)[0]) == 60


@pytest.mark.parametrize(
    "x",
    [
        UP,
        UP[::-1],
        np.linspace(-0.5, 2.0, 40),
        np.random.default_rng(0).permutation(UP),
        UP + 0.01 * np.random.default_rng(1).normal(size=30),
        np.array([0.0, 0.1, 0.2]),
        np.zeros(5),
    ],
)
@pytest.mark.parametrize("choice", [None, "first", "last", "all"])
def test_a_record_without_cycles_is_taken_whole(x, choice):
    rows, said = rows_of_cycle(x, choice)
    np.testing.assert_array_equal(rows, np.arange(len(x)))
    assert not said


@pytest.mark.parametrize("choice", ["0", "4", "2 holds", "1 unloading up"])
def test_what_is_no_cycle_is_refused(choice):
    with pytest.raises(UsageError, match="no cycle"):
        rows_of_cycle(np.tile(CYCLE, 3), choice)
