"""The founding study's two cantilevers: 501 loads from 0 to 5 N by 0.01 N, and 100 random ones.

Every other load trains (251), the rest and the random ones test (350). The outputs are the vertical
deflections of the five free nodes, full scale is the largest tip deflection (Narayanan, Singla, Garimella, Waz
& Krovi 2011: L = 1 m, r = 5 mm, nodes every 0.2 m).
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from palpate.physics.beam.beam_presets import preset
from palpate.surrogates import Surrogate
from palpate.units import Quantity, Range

__all__ = ["BEAMS", "FEW", "Case", "Errors", "case", "touch_model"]

BEAMS = ("copper", "nylon")
FEW = 26  # solves: 0 to 5 N by 0.2 N
_TEST_SEED = 7


@dataclass(frozen=True)
class Errors:
    """Errors on the test loads, relative to full scale.

    Attributes
    ----------
    rmse, largest : float
    outer, rest : float
        RMSE in the outer 10 % of the range (5 % at each end) and in the rest.
    """

    rmse: float
    largest: float
    outer: float
    rest: float


@dataclass(frozen=True, eq=False)
class Case:
    """One beam's solves, SI units.

    Attributes
    ----------
    name : str
    inputs : (Range,)
    outputs : 5 quantities
    X, Y : (N, 1), (N, 5)
        Training loads and deflections.
    X_test, Y_test : (M, 1), (M, 5)
    """

    name: str
    inputs: tuple[Range, ...]
    outputs: tuple[Quantity, ...]
    X: np.ndarray
    Y: np.ndarray
    X_test: np.ndarray
    Y_test: np.ndarray

    @property
    def full_scale(self) -> float:
        """Largest tip deflection, m."""
        return float(max(np.abs(self.Y).max(), np.abs(self.Y_test).max()))

    def few(self, count: int = FEW) -> tuple[np.ndarray, np.ndarray]:
        """`count` of the training solves, evenly spread, both ends among them."""
        rows = np.round(np.linspace(0, len(self.X) - 1, count)).astype(int)
        return self.X[rows], self.Y[rows]

    def errors(self, predicted: np.ndarray) -> Errors:
        """Judge predictions (M, 5) at the test loads."""
        error = (predicted - self.Y_test) / self.full_scale
        low, high = self.inputs[0].low, self.inputs[0].high
        share = (self.X_test[:, 0] - low) / (high - low)
        outer = (share < 0.05) | (share > 0.95)
        return Errors(_rms(error), float(np.abs(error).max()), _rms(error[outer]), _rms(error[~outer]))


def _rms(error: np.ndarray) -> float:
    return float(np.sqrt((error**2).mean()))


@functools.cache
def case(beam: str, loads: int = 501) -> Case:
    """Solve a beam; the solves are kept for the rest of the process.

    Parameters
    ----------
    beam : str
        ``"copper"`` or ``"nylon"``.
    loads : int
        On the grid from 0 to 5 N.
    """
    problem = preset(f"beam-{beam}").problem()
    solver = problem.open()
    low, high = problem.ranges[0].low, problem.ranges[0].high
    grid = np.linspace(low, high, loads)
    random = np.sort(np.random.default_rng(_TEST_SEED).uniform(low, high, 100))
    free = [int(i) for i in np.flatnonzero(problem.of_interest) if problem.rest[i, 0] > 0]

    def deflections(P: np.ndarray) -> np.ndarray:
        return np.array([solver.solve(p).displacement[free, 1] for p in P])

    X, Y = grid[:, None], deflections(grid)
    outputs = tuple(Quantity(f"u_y at {problem.rest[i, 0]:g} m", "m") for i in free)
    X_test = np.vstack([X[1::2], random[:, None]])
    return Case(
        beam, problem.ranges, outputs, X[::2], Y[::2], X_test, np.vstack([Y[1::2], deflections(random)])
    )


@functools.cache
def touch_model(beam: str, *, quick: bool = False) -> Surrogate:
    """The beam as a body that can be touched: `palpate.sweep` and `palpate.learn` as a user calls them.

    `quick` takes few solves, one pass and a rough refinement.
    """
    import palpate

    found = preset(f"beam-{beam}")
    data = palpate.sweep(
        *(found.body, found.loads),
        samples=26 if quick else found.samples,
        design="grid",
        workers=1,
        progress=False,
    )
    if quick:
        return palpate.learn(data, name=beam, passes=1, refinement=palpate.Refinement(starts=1, target=1e-3))[
            0
        ]
    return palpate.learn(data.every(2), name=beam)[0]
