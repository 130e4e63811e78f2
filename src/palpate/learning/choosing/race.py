"""A race between unit forms, radial functions and sizes: each is refined a little, the best go on.

Errors on held-out samples decide (successive halving: Jamieson & Talwalkar 2016). Everyone starts with the inverse
multiquadric, whose long tails lead units to where they are wanted from afar; from there the winner's units are
carried over to the other radial functions.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from palpate.network.radial import RadialFunction
from palpate.rbf.forms import Centred, Form, unit_form
from palpate.rbf.refinement.refine import Refined, refine
from palpate.rbf.regressors import Regressors

__all__ = ["Race", "Runner", "Split", "carried", "forms_for", "start"]

RIDGE = 1e-10
_FIRST: RadialFunction = "inverse-multiquadric"
# how much faster the others fall off: their scales, for a unit as wide at half its height
_STEEPER: dict[RadialFunction, float] = {"gaussian": 0.48, "matern-5/2": 0.6, "inverse-multiquadric": 1.0}


@dataclass(frozen=True, eq=False)
class Split:
    """Samples to learn from and to be judged by, scaled: X (N, n), Y (N, k), and held-out ones.

    `held` (N + N',) says which of all samples these are.
    """

    X: np.ndarray
    Y: np.ndarray
    unseen: tuple[np.ndarray, np.ndarray]
    held: np.ndarray

    @classmethod
    def of(cls, X: np.ndarray, Y: np.ndarray, *, share: float, seed: int, fold: int = 0) -> Split:
        """Hold out the fold-th share of a shuffle that the seed decides; folds beyond the last begin again.

        Samples at one place stay together, as far as two parts can be made: a copy of what was learnt judges nothing.
        """
        order = np.random.default_rng(seed).permutation(len(X))
        group = np.unique(X, axis=0, return_inverse=True)[1].ravel()
        if group.max() + 1 < len(X):
            return cls._by_groups(X, Y, order, group, share, fold)
        count = max(2, round(share * len(X)))
        first = (fold * count) % max(1, len(X) - count + 1)
        held = np.zeros(len(X), bool)
        held[order[first : first + count]] = True
        kept = order[~held[order]]
        return cls(X[kept], Y[kept], (X[held], Y[held]), held)

    @classmethod
    def _by_groups(
        cls, X: np.ndarray, Y: np.ndarray, order: np.ndarray, group: np.ndarray, share: float, fold: int
    ) -> Split:
        places = group[order][
            np.sort(np.unique(group[order], return_index=True)[1])
        ]  # in order of appearance
        count = max(1, round(share * len(places)))
        first = (fold * count) % max(1, len(places) - count + 1)
        held = np.isin(group, places[first : first + count])
        kept = order[~held[order]]
        return cls(X[kept], Y[kept], (X[held], Y[held]), held)

    def first(self, count: int) -> Split:
        """The same with `count` samples to learn from at most."""
        return replace(self, X=self.X[:count], Y=self.Y[:count])


@dataclass(frozen=True, eq=False)
class Runner:
    """One that takes part: its units θ (h, p) now, the best error so far and the iterations spent."""

    regressors: Regressors
    theta: np.ndarray
    heldout: float = float("inf")
    iterations: int = 0
    found: Refined | None = None

    @property
    def name(self) -> str:
        """Form, radial function and number of units."""
        return f"{len(self.theta)} {self.regressors.form.name} {self.regressors.radial}"


@dataclass(frozen=True, eq=False)
class Race:
    """The course: samples, the input scales (n,) of a likely metric, the seed and the last moment."""

    split: Split
    scales: np.ndarray
    seed: int
    deadline: float

    def entered(self, name: str, numbers: int, fewest: int = 2) -> Runner:
        """A runner of a form with about `numbers` numbers in its units."""
        form = unit_form(name, self.split.X.shape[1])
        h = int(np.clip(numbers // form.size, fewest, max(fewest, self.room(form.size))))
        return Runner(Regressors(form, _FIRST), start(form, self.split.X, self.scales, h, self.seed))

    def room(self, size: int) -> int:
        """Most units of `size` numbers: a sixth of the samples, and half as many unknowns as numbers observed."""
        N = len(self.split.X)
        sizes = np.linalg.norm(self.split.Y, axis=0)
        k = max(1, int((sizes > 1e-3 * sizes.max(initial=0.0)).sum()))
        return min(N // 6, N * k // (2 * (size + k)))

    def run(
        self, runner: Runner, iterations: int, *, samples: int | None = None, patience: int = 20
    ) -> Runner:
        """The runner after some more iterations, on the first `samples` only if that is said."""
        left = self.deadline - time.monotonic()
        if left <= 0:
            return runner
        split = self.split if samples is None else self.split.first(samples)
        found = refine(
            split.X,
            split.Y,
            runner.theta,
            runner.regressors,
            ridge=RIDGE,
            iterations=iterations,
            seconds=left,
            heldout=split.unseen,
            patience=patience,
            tolerance=1e-7,
        )
        best = min(found.heldout, runner.heldout)
        # what was best on few samples is a start on all of them, not a rival
        return replace(
            runner,
            theta=found.theta,
            heldout=found.heldout if samples is None else best,
            iterations=runner.iterations + found.iterations,
            found=found,
        )


def forms_for(inputs: int) -> tuple[str, ...]:
    """Forms worth a race; rotated units only while their numbers stay few."""
    if inputs == 1:
        return ("axis-aligned",)
    oblique = tuple(f"rank-{r}" for r in (1, 2) if r < inputs)
    return (*oblique, "rotated", "axis-aligned") if inputs <= 12 else (*oblique, "axis-aligned")


def start(form: Form, X: np.ndarray, scales: np.ndarray, count: int, seed: int) -> np.ndarray:
    """Units θ (count, p) at random samples of X, as wide as the scales (n,) say, in random directions."""
    rng = np.random.default_rng((seed, count, form.size))
    centres = X[rng.choice(len(X), count, replace=count > len(X))]
    if isinstance(form, Centred):
        widths = np.exp(rng.normal(0.0, 0.1, (count, len(scales)))) / np.clip(scales, 0.05, 20.0)
        return form.of(centres, widths)
    r = form.rank
    A = rng.normal(0.0, 1.5 / np.sqrt(r), (count, r, len(scales))) * scales
    return np.hstack([A.reshape(count, -1), np.einsum("krn,kn->kr", A, centres)])


def carried(runner: Runner, radial: RadialFunction) -> Runner:
    """The runner's units with another radial function, as wide as before at half their height."""
    form, factor = runner.regressors.form, _STEEPER[radial] / _STEEPER[runner.regressors.radial]
    theta = runner.theta.copy()
    if isinstance(form, Centred):
        widths = form.size - form.inputs - (form.rows.size - form.inputs)
        theta[:, form.inputs : form.inputs + widths] -= np.log(factor)
        theta[:, form.inputs + widths :] *= factor
    else:
        theta *= factor
    return replace(
        runner,
        regressors=replace(runner.regressors, radial=radial),
        theta=theta,
        heldout=float("inf"),
        found=None,
    )


def best_of(runners: Sequence[Runner]) -> Runner:
    """Least error on held-out samples."""
    return min(runners, key=lambda runner: runner.heldout)
