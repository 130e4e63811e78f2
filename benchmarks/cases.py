"""The founding study's two cantilevers: 501 loads from 0 to 5 N by 0.01 N, and 100 random ones.

Every other load trains (251), the rest and the random ones test (350). The outputs are the vertical
deflections of the five free nodes, full scale is the largest tip deflection (Narayanan, Singla, Garimella, Waz
& Krovi 2011: L = 1 m, r = 5 mm, nodes every 0.2 m).
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.network import Network, Scaling
from palpate.physics.beam.beam_presets import preset
from palpate.surrogates import (
    ContactBaseline,
    ContactLaw,
    Continuation,
    LearntEnergy,
    PadBaseline,
    RestStiffness,
    Stiffening,
    Surrogate,
    TouchedSurface,
)
from palpate.units import Quantity, Range

__all__ = ["BEAMS", "FEW", "Case", "Errors", "case", "formula_block", "formula_pad", "touch_model"]

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


def formula_block(memory: Any = None) -> Surrogate:
    """A flat body of U = A s³, 1 N at 6 mm, by its formula: where it is no matter how it was learnt."""
    radius, deepest = 0.010, 0.006  # m
    inputs = [
        Range("c_x", -0.02, 0.02, "m"),
        Range("c_y", -0.02, 0.02, "m"),
        Range("c_z", radius - deepest, radius, "m"),
    ]
    corners = 0.06 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    face = TouchedSurface.of(corners, np.array([[0, 1, 2], [0, 2, 3]]), radius=radius, spacing=0.003)
    baseline = ContactBaseline(ContactLaw("pad"), face, radius)
    going = Continuation.of(inputs, deepest=deepest)
    energy = LearntEnergy(_constant(inputs, math.log(1e4)), baseline, continuation=going)
    return Surrogate(energy, memory=memory, meta={"name": "block"})


def formula_pad(stiffness: float = 200.0) -> Surrogate:
    """A held body of U = ½ K |w|² up to 30 mm in each direction, by its formula."""
    inputs = [Range(f"w_{axis}", -0.03, 0.03, "m") for axis in "xyz"]
    rest = RestStiffness.even(stiffness * np.eye(3))
    baseline = PadBaseline(rest, Stiffening.none(3), axes=np.eye(3))
    return Surrogate(LearntEnergy(_constant(inputs, 0.0), baseline), meta={"name": "pad"})


def _constant(inputs: list[Range], value: float) -> Network:
    """A network that answers `value` everywhere."""
    n = len(inputs)
    low, high = np.array([r.low for r in inputs]), np.array([r.high for r in inputs])
    return Network.axis_aligned(
        inputs,
        [Quantity("ℓ")],
        centres=np.zeros((2, n)),
        widths=np.ones((2, n)),
        weights=np.zeros((1, 2)),
        tail=np.array([[value] + n * [0.0]]),
        scaling=Scaling((low + high) / 2, (high - low) / 2, np.zeros(1), np.ones(1)),
    )
