"""The founding study's two beams on real finite elements: the figures that palpate promises.

251 of 501 loads train, the other 250 and 100 random loads test; outputs are the five free nodes' deflections;
full scale is the largest tip deflection.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from palpate.learning import Settings, default, founding, learn, refined_network
from palpate.physics.beam.beam_presets import preset
from palpate.units import Quantity

pytestmark = pytest.mark.full
SEEDS = (0, 1, 2)
TIGHT_SEEDS = (0, 1)  # a tightened filter grows many units: each run takes as long as four others


class Beam:
    """Solves of one beam: training and test loads (N, 1) and deflections (N, 5)."""

    def __init__(self, name: str) -> None:
        found = preset(name)
        problem = found.problem()
        solver = problem.open()
        loads = np.linspace(0.0, 5.0, 501)
        unseen = np.sort(np.random.default_rng(11).uniform(0.0, 5.0, 100))
        nodes = np.flatnonzero(problem.of_interest)[1:]

        def solve(P: np.ndarray) -> np.ndarray:
            answers = [solver.solve(np.array([p])) for p in P]
            assert all(a.converged for a in answers)
            return np.array([a.displacement[nodes, 1] for a in answers])

        self.ranges = problem.ranges
        self.outputs = tuple(Quantity(f"u{i}", "m") for i in range(5))
        U = solve(loads)
        self.X, self.Y = loads[::2, None], U[::2]
        self.test = np.concatenate([loads[1::2], unseen])[:, None], np.vstack([U[1::2], solve(unseen)])
        self.full_scale = np.abs(U).max()

    @functools.cache  # noqa: B019 - two beams live as long as the module's tests
    def filtered(self, form: Callable[[], Settings], seed: int):
        """What a preset learns, a tightened one too; several tests ask for the same."""
        return learn(self.X, self.Y, self.ranges, self.outputs, settings=form(), seed=seed, heldout=self.test)

    def rmse(self, network, rows=slice(None)) -> float:
        X, Y = self.test
        return float(np.sqrt(((network.predict(X[rows]) - Y[rows]) ** 2).mean()) / self.full_scale)


@pytest.fixture(scope="module", params=["beam-copper", "beam-nylon"])
def beam(request):
    return Beam(request.param)


def tight(settings: Settings) -> Settings:
    return replace(
        settings,
        error_min=settings.error_min / 10,
        error_rms_min=settings.error_rms_min / 10,
        distance_min=settings.distance_min / 10,
    )


def tight_default() -> Settings:
    return tight(default())


def tight_founding() -> Settings:
    return tight(founding())


def test_founding_form(beam):
    errors = [beam.rmse(beam.filtered(founding, s).network) for s in SEEDS]
    assert np.median(errors) < 2e-3


def test_tightened_tenfold_the_default_form_regresses_less_than_the_founding_one(beam):
    worst = [
        max(beam.filtered(f, s).history.regression for s in TIGHT_SEEDS)
        for f in (tight_default, tight_founding)
    ]
    assert worst[0] < 0.5 * worst[1]


def test_default_form(beam, request):
    target = 1e-4 if "copper" in request.node.name else 1e-3
    loads = beam.test[0][:, 0]
    outer = (loads < 0.25) | (loads > 4.75)
    for seed in SEEDS:
        learned = beam.filtered(default, seed)
        assert beam.rmse(learned.network) < target
        assert beam.rmse(learned.network) < beam.rmse(beam.filtered(founding, seed).network)
        assert learned.history.regression < 2.0
        assert beam.rmse(learned.network, outer) < 2.0 * beam.rmse(learned.network, ~outer)


def test_default_form_is_stable_when_its_thresholds_are_tightened_tenfold(beam):
    for seed in TIGHT_SEEDS:
        assert beam.filtered(tight_default, seed).history.regression < 2.0


def test_refined_network_from_26_solves(beam):
    few = np.round(np.linspace(0, 250, 26)).astype(int)
    network, _, _ = refined_network(beam.X[few], beam.Y[few], beam.ranges, beam.outputs, units_max=6)
    assert network.units <= 6
    assert beam.rmse(network) < 5e-6
