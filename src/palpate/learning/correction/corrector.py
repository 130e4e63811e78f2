"""A pressed body that follows a physical specimen: measured forces in, a corrected surrogate out.

corrector = Corrector(surrogate)
event = corrector.observe(position, force)      # SI units, as often as the sensor speaks
corrector.surrogate                             # the corrected one, whenever it is asked for
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from threadpoolctl import threadpool_limits

from palpate.errors import UsageError
from palpate.learning.correction.corrected_surrogate import corrected_surrogate
from palpate.learning.correction.load_cell import LoadCell, cell_from_residuals
from palpate.learning.correction.prior import add_broad_units, specimen_prior
from palpate.learning.correction.specimen_posterior import SpecimenPosterior
from palpate.learning.correction.touches import Touches
from palpate.options import Discrepancy, Noise
from palpate.surrogates import ContactBaseline, Surrogate
from palpate.surrogates.baselines import ToolBaseline
from palpate.units import bounds

__all__ = ["Corrector", "Event", "Verdict"]

Verdict = Literal["learnt", "no contact", "outside", "outlier", "not finite"]
_FREE = 4.0  # deviations of the surface's height: farther above it nothing is to be learnt
_CLEAR = 5e-4  # m above the surface at least where a probe is in air
_BEYOND = 0.25  # of the width over which ℓ is followed beyond a range
_ENOUGH = 30  # touches from which it is judged how far the noise is larger than was said
_MEDIANS = (0.674, 1.538)  # of the size of one and of three standard normal numbers
_MOST_INFLATED = 20.0  # at most: what is farther off is no noise
_ROUNDS = 6  # of looking again which touches are outliers


@dataclass(frozen=True)
class Event:
    """The fate of one measurement.

    Attributes
    ----------
    verdict : {"learnt", "no contact", "outside", "outlier", "not finite"}
        What is outside of the trained depth or ranges, and what is no number, teaches nothing.
    predicted : (3,)
        The force expected before, N.
    distance : float
        Of the measured force from it, in standard deviations (Mahalanobis 1936); not-a-number where it was not asked.
    """

    verdict: Verdict
    predicted: np.ndarray
    distance: float = math.nan


class Corrector:
    """An extended Kalman filter on the linear weights of ℓ and the height of the surface.

    The prior is the posterior of the training with the discrepancy added. The last `window` touches are kept; when
    they are complete, and whenever the surrogate is asked for, all of them are taken again from the posterior
    before them, with rows at the most probable θ and outliers judged anew: within a window the result does not
    depend on the order of the touches. With forgetting nothing is taken again.

    Cost of a touch: about 10 z² operations for z numbers that may change; of a window of w touches some ten times
    3 w z².

    Parameters
    ----------
    surrogate : Surrogate
        A body that is pressed by a probe.
    parameters : sequence of p numbers
        The specimen's further inputs, where the surrogate has any.
    discrepancy : Discrepancy, optional
        How far a specimen may differ from the model.
    noise : Noise, optional
        Standard deviations of the measured forces and positions.
    gate : float
        Touches farther than so many standard deviations from what is expected are outliers. Of three Gaussian
        components one in 65,000 is farther than five.
    window : int
        Touches that are kept and taken again together.
    memory : float, optional
        Touches after which 1 − 1/e of the certainty is forgotten; None keeps all.

    Attributes
    ----------
    counts : Counter
        Of the verdicts.
    body : Surrogate
        The body as it came.
    model : LearntEnergy
        Its energy, with the units by which it may change.

    Raises
    ------
    UsageError
        If parameters or options do not fit.
    """

    def __init__(
        self,
        surrogate: Surrogate,
        *,
        parameters: Sequence[float] = (),
        discrepancy: Discrepancy = Discrepancy(),  # noqa: B008 - a frozen value
        noise: Noise = Noise(),  # noqa: B008
        gate: float = 5.0,
        window: int = 500,
        memory: float | None = None,
    ) -> None:
        if not (
            isinstance(surrogate, Surrogate)
            and isinstance(surrogate.hand_energy.baseline, ContactBaseline)
            and not isinstance(surrogate.hand_energy.baseline, ToolBaseline)
        ):
            raise UsageError(
                f"{surrogate!r:.60} can't be corrected.",
                why="Measured forces correct a body that a ball presses.",
                fix="Pass the body of a study of touches, as `palpate.load` reads it.",
            )
        p = np.array(parameters, dtype=np.float64)
        if p.shape != (len(surrogate.parameters),) or not np.isfinite(p).all():
            names = ", ".join(r.name for r in surrogate.parameters) or "none"
            raise UsageError(
                f"{p.size} parameters came for a surrogate of {len(surrogate.parameters)}.",
                why=f"A specimen is one member of the family; its further inputs are: {names}.",
                fix="Give a finite number for each of them, in SI units.",
            )
        if not (gate > 0 and window >= 1 and (memory is None or memory > 0)):
            raise UsageError(
                f"gate={gate}, window={window} and memory={memory} allow no correction.",
                fix="Give positive numbers.",
            )
        energy = (
            surrogate.hand_energy
            if "correction" in surrogate.meta
            else add_broad_units(surrogate.hand_energy, discrepancy)
        )
        self.body, self.model, self.noise, self.gate = surrogate, energy, noise, gate
        self.counts: Counter[str] = Counter()
        self._prior = specimen_prior(self.model, discrepancy)
        self._anchor = self._posterior = SpecimenPosterior.standard(self._prior.root.shape[1] + 1)
        self._parameters, self._window, self._memory = p, window, memory
        self._noise_inflation = self._inflation_before = 1.0  # now, and when the window began
        self._seen: list[Touches] = []
        self._learnt: list[bool] = []

    def __str__(self) -> str:
        height, sure = self.offset
        said = ", ".join(f"{n} {verdict}" for verdict, n in self.counts.items()) or "nothing measured"
        return f"Corrector: {said}; surface {1e3 * height:+.2f} ± {1e3 * sure:.2f} mm"

    @property
    def posterior(self) -> SpecimenPosterior:
        """Posterior of θ (see `touches`): the weights' standard normal numbers, then the height's."""
        return self._posterior

    @property
    def offset(self) -> tuple[float, float]:
        """Height of the specimen's surface over the model's and its standard deviation, m."""
        scale = self._prior.offset
        return scale * float(self._posterior.mean[-1]), scale * self._posterior.spread(-1)

    @property
    def parameters(self) -> np.ndarray:
        """The specimen's further inputs (p,)."""
        return self._parameters

    @property
    def noise_inflation(self) -> float:
        """Factor by which the noise is larger than was said, by the residuals of the last window; 1 at least.

        What no change of the weights explains counts as noise: then the posterior covers it.
        """
        return self._noise_inflation

    @property
    def clearance(self) -> float:
        """Height over the model's surface from which a probe is in air whatever the specimen, m."""
        return max(_FREE * self._prior.offset, _CLEAR)

    def load_cell(self, largest: float) -> LoadCell:
        """Offset of the load cell, by what the touches of the window leave; `largest` is the largest force, N."""
        self.settle()
        learnt = np.array(self._learnt, bool)
        if not learnt.any():
            return LoadCell()
        touches = Touches.joined(self._seen).take(learnt)
        weights = np.full(len(touches), self._noise_inflation**-2)
        return cell_from_residuals(
            touches.weighted(weights), self._posterior.mean, largest, self.noise.absolute
        )

    @property
    def expressed(self) -> float:
        """Share of the slowly varying change that the network can follow."""
        return self._prior.expressed

    @property
    def surrogate(self) -> Surrogate:
        """The corrected body, all touches of the window taken again first.

        Raises
        ------
        UsageError
            If the surface came to lie so high that the model's distance does not reach it.
        """
        self.settle()
        return corrected_surrogate(self.body, self.model, self._prior, self._posterior, self.counts)

    def observe(self, position: np.ndarray, force: np.ndarray, *, along: np.ndarray | None = None) -> Event:
        """Learn one measurement.

        Parameters
        ----------
        position : (3,)
            The probe's centre, m.
        force : (3,)
            On the probe, N.
        along : (3,), optional
            Unit vector of the only component that was measured; the others of `force` do not count.

        Raises
        ------
        UsageError
            If an array has another shape.
        """
        c, F = np.array(position, np.float64), np.array(force, np.float64)
        n = np.zeros(3) if along is None else np.array(along, np.float64)
        if c.shape != (3,) or F.shape != (3,) or n.shape != (3,):
            raise UsageError(
                f"A force {F.shape} at {c.shape} along {n.shape} is no measurement.", fix="Pass (3,) arrays."
            )
        event = self._event(c, F, n)
        self.counts[event.verdict] += 1
        return event

    def settle(self) -> None:
        """Take all touches of the window again, with rows where θ now is; does nothing with forgetting."""
        if not self._seen or self._memory is not None:
            return
        everything = Touches.joined(self._seen)
        with threadpool_limits(1), np.errstate(over="ignore", invalid="ignore"):
            learnt = self._in_doubt(everything)
            everything = everything.weighted(np.full(len(everything), self._noise_inflation**-2))
            for _ in range(_ROUNDS):
                self._posterior = self._anchor.update_by_touches(everything.take(learnt))
                near = self._distances(everything, learnt) <= self.gate
                if (near == learnt).all():
                    break
                learnt = near
        change = int(learnt.sum()) - sum(self._learnt)
        self.counts["learnt"] += change
        self.counts["outlier"] -= change
        self._learnt = learnt.tolist()

    def _in_doubt(self, touches: Touches) -> np.ndarray:
        """Return a mask (N,) of touches that are no outliers, by all of them with less weight for the far ones.

        (Huber 1964.) So the choice does not depend on which came first.
        """
        self._noise_inflation = self._inflation_before  # taken again, the same window gives the same
        weights, everyone = np.ones(len(touches)), np.ones(len(touches), bool)
        for _ in range(_ROUNDS):
            self._posterior = self._anchor.update_by_touches(
                touches.weighted(weights / self._noise_inflation**2)
            )
            far = self._distances(
                touches.weighted(np.full(len(touches), self._noise_inflation**-2)), everyone
            )
            if len(touches) >= _ENOUGH:
                ratio = np.median(far / np.where(touches.single, *_MEDIANS))
                self._noise_inflation = min(max(1.0, self._noise_inflation * float(ratio)), _MOST_INFLATED)
            weights = np.minimum(1.0, self.gate / np.maximum(far, 1e-12))
        return np.asarray(far <= self.gate)

    def _event(self, c: np.ndarray, F: np.ndarray, along: np.ndarray) -> Event:
        nothing = np.full(3, math.nan)
        if not np.isfinite([c, F, along]).all():
            return Event("not finite", nothing)
        X = np.concatenate([c, self._parameters])[None]
        said = Touches.of(self.model, self._prior, X, F[None], along[None], self.noise)
        touch = said.weighted(np.full(1, self._noise_inflation**-2))
        with np.errstate(over="ignore", invalid="ignore"):
            predicted = touch.forces(self._posterior.mean)[0]
            height, sure = self.offset
            free = touch.depth[0] + height <= -_FREE * sure
            if not free and self._outside(X[0], touch.depth[0]):
                return Event("outside", predicted)
            distance = float(self._distances(touch, np.zeros(1, bool))[0])
            if not distance <= self.gate:
                if not free:
                    self._keep(said, learnt=False)
                return Event("outlier", predicted, distance)
            if free:
                return Event("no contact", predicted, distance)
            self._posterior = self._posterior.update_by_touches(touch)
            if self._memory is not None:
                self._posterior = self._posterior.forget(-math.expm1(-1.0 / self._memory))
        self._keep(said, learnt=True)
        return Event("learnt", predicted, distance)

    def _keep(self, touch: Touches, *, learnt: bool) -> None:
        if self._memory is not None:
            return
        self._seen.append(touch)
        self._learnt.append(learnt)
        if len(self._seen) >= self._window:
            self.counts["learnt" if learnt else "outlier"] += 1  # this one is counted after it has been kept
            self.settle()
            self.counts["learnt" if learnt else "outlier"] -= 1
            self._anchor, self._seen, self._learnt = self._posterior, [], []
            self._inflation_before = self._noise_inflation

    def _outside(self, x: np.ndarray, depth: float) -> bool:
        """Return True where the probe is deeper than trained, or far beyond a range."""
        low, high = bounds(self.model.inputs)
        going = self.model.going
        wide = _BEYOND * going.widths
        return bool(depth > going.deepest or (x < low - wide).any() or (x > high + wide).any())

    def _distances(self, touches: Touches, learnt: np.ndarray) -> np.ndarray:
        """Return Mahalanobis distances (N,) of measured from expected forces; touches learnt lose their own part."""
        r = touches.residuals(self._posterior.mean)
        J = touches.rows(self._posterior.mean, self._posterior.spread(-1)) @ self._posterior.root
        own = J @ J.transpose(0, 2, 1)
        # a touch that was learnt has a residual of variance I − J S⁺S⁺ᵀJᵀ
        S = np.eye(3) + np.where(learnt, -1.0, 1.0)[:, None, None] * own
        values, V = np.linalg.eigh(S)
        turned = np.einsum("nij,ni->nj", V, r)
        return np.asarray(np.sqrt((turned**2 / np.maximum(values, 1e-3)).sum(axis=1)))
