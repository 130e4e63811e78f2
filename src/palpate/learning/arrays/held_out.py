"""Candidates for arrays: units of every form, refined on some samples and compared by the error on held-out ones.

Everyone starts with the inverse multiquadric, whose long tails lead units to where they are wanted from afar; from
there the winner's units are carried over to the other radial functions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from palpate.learning.folds import held_out, near_places
from palpate.learning.search import Candidate, iteration_work
from palpate.network.radial import RadialFunction
from palpate.rbf.forms import Centred, Form, unit_form
from palpate.rbf.refinement.refine import refine
from palpate.rbf.regressors import Regressors

__all__ = ["FIRST_RADIAL", "RIDGE", "HeldOut", "carry", "forms_for", "start_units"]

RIDGE = 1e-10
FIRST_RADIAL: RadialFunction = "inverse-multiquadric"
"""Of the units that everyone starts with."""

_PATIENCE = 20
# how much faster the others fall off: their scales, for a unit as wide at half its height
_STEEPER: dict[RadialFunction, float] = {"gaussian": 0.48, "matern-5/2": 0.6, "inverse-multiquadric": 1.0}


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Samples to learn from and to be judged by, scaled."""

    X: np.ndarray  # (N, n), to learn from, in a random order
    Y: np.ndarray  # (N, k)
    unseen: tuple[np.ndarray, np.ndarray]  # (N', n) and (N', k), to be judged by
    held: np.ndarray  # (N + N',), which of all samples those are
    partial: bool = False

    @classmethod
    def of(
        cls,
        X: np.ndarray,
        Y: np.ndarray,
        *,
        share: float,
        seed: int,
        fold: int = 0,
        places: np.ndarray | None = None,
    ) -> HeldOut:
        """Hold out the fold-th share of a shuffle that the seed decides; see `palpate.learning.folds.held_out`."""
        places = near_places(X) if places is None else places
        kept, held = held_out(places, share, seed=seed, fold=fold)
        return cls(X[kept], Y[kept], (X[held], Y[held]), held)

    @classmethod
    def without(cls, X: np.ndarray, Y: np.ndarray, held: np.ndarray, *, seed: int) -> HeldOut:
        """Hold out a mask (N,) of samples; the others are in an order that the seed decides."""
        order = np.random.default_rng(seed).permutation(len(X))
        kept = order[~held[order]]
        return cls(X[kept], Y[kept], (X[held], Y[held]), held)

    def first(self, count: int) -> HeldOut:
        """Return the same with `count` samples to learn from at most, `partial`.

        A candidate then keeps the best error that it had: what was best on few samples is a start on all of them, not a
        rival.
        """
        return replace(self, X=self.X[:count], Y=self.Y[:count], partial=True)

    def evaluate(self, candidate: Candidate, iterations: int, seconds: float | None = None) -> Candidate:
        """Refine a candidate's units on the samples to learn from; its error is that on those held out."""
        network = refine(
            *(self.X, self.Y, candidate.theta, candidate.regressors),
            ridge=RIDGE,
            iterations=iterations,
            seconds=seconds,
            heldout=self.unseen,
            patience=_PATIENCE,
            tolerance=1e-7,
        )
        return replace(
            candidate,
            theta=network.theta,
            error=min(network.heldout, candidate.error) if self.partial else network.heldout,
            network=network,
            iterations=candidate.iterations + network.iterations,
        )

    def work(self, candidate: Candidate) -> float:
        """Return the multiplications of one iteration."""
        k = self._modes
        return iteration_work(len(self.X), candidate.theta.size, len(candidate.theta), k)

    @property
    def _modes(self) -> int:
        """Number of outputs that are more than a thousandth of the largest."""
        sizes = np.linalg.norm(self.Y, axis=0)
        return max(1, int((sizes > 1e-3 * sizes.max(initial=0.0)).sum()))

    def room(self, size: int) -> int:
        """Return the most units of `size` numbers: a sixth of the samples, unknowns half the numbers observed."""
        N, k = len(self.X), self._modes
        return min(N // 6, N * k // (2 * (size + k)))

    def enter(self, form: str, numbers: int, scales: np.ndarray, seed: int) -> Candidate:
        """Return a candidate of a form with about `numbers` numbers in its units, as wide as scales (n,) say."""
        units = unit_form(form, self.X.shape[1])
        h = int(np.clip(numbers // units.size, 2, max(2, self.room(units.size))))
        theta = start_units(units, self.X, scales, h, seed)
        return Candidate(Regressors(units, FIRST_RADIAL), theta, "random")


def forms_for(inputs: int) -> tuple[str, ...]:
    """Return the forms worth a trial; rotated units only while their numbers stay few."""
    if inputs == 1:
        return ("axis-aligned",)
    oblique = tuple(f"rank-{r}" for r in (1, 2) if r < inputs)
    return (*oblique, "rotated", "axis-aligned") if inputs <= 12 else (*oblique, "axis-aligned")


def start_units(form: Form, X: np.ndarray, scales: np.ndarray, count: int, seed: int) -> np.ndarray:
    """Return units θ (count, p) at random samples of X, as wide as the scales (n,) say, in random directions."""
    rng = np.random.default_rng((seed, count, form.size))
    centres = X[rng.choice(len(X), count, replace=count > len(X))]
    if isinstance(form, Centred):
        widths = np.exp(rng.normal(0.0, 0.1, (count, len(scales)))) / np.clip(scales, 0.05, 20.0)
        return form.of(centres, widths)
    r = form.rank
    A = rng.normal(0.0, 1.5 / np.sqrt(r), (count, r, len(scales))) * scales
    return np.hstack([A.reshape(count, -1), np.einsum("krn,kn->kr", A, centres)])


def carry(candidate: Candidate, radial: RadialFunction) -> Candidate:
    """Return the candidate's units with another radial function, as wide as before at half their height."""
    form = candidate.regressors.form
    factor = _STEEPER[radial] / _STEEPER[candidate.regressors.radial]
    theta = candidate.theta.copy()
    if isinstance(form, Centred):
        widths = form.size - form.inputs - (form.rows.size - form.inputs)
        theta[:, form.inputs : form.inputs + widths] -= np.log(factor)
        theta[:, form.inputs + widths :] *= factor
    else:
        theta *= factor
    return replace(
        candidate,
        regressors=replace(candidate.regressors, radial=radial),
        theta=theta,
        start="carried",
        error=math.inf,
        network=None,
    )
