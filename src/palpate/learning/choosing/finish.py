"""From what was chosen to what is handed over: weights from all samples, intervals, the trained region."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.learning.choosing import calibration
from palpate.learning.choosing.arrays import Samples
from palpate.learning.choosing.calibration import Evidence
from palpate.learning.choosing.committee import Member, averaged
from palpate.learning.choosing.fitted import Choice, Fitted
from palpate.learning.choosing.kernel_layer import KernelLayer, Metric
from palpate.learning.choosing.problem import Problem
from palpate.learning.choosing.race import Split
from palpate.network import TrainedRegion
from palpate.network.radial import RadialFunction
from palpate.rbf.refinement.refine import Refined

__all__ = ["Finish"]


@dataclass(frozen=True, eq=False)
class Finish:
    """What a result needs to know beside its network."""

    samples: Samples
    problem: Problem
    split: Split
    trials: Sequence[Choice]
    began: float
    seed: int
    level: float

    def network(
        self,
        members: Sequence[Member],
        error: float,
        *,
        form: str | None = None,
        evidence: Sequence[Evidence] = (),
    ) -> Fitted:
        """Of one network or the average of several; their own errors, and further evidence, set the intervals."""
        regressors, X = members[0].found.regressors, self.problem.X
        evidence = [self._own(members, error), *evidence]
        M = None
        if sum(len(member.found.coefficients) for member in members) <= calibration.LARGEST:
            root = calibration.committee_root([member.found for member in members], X)
            M = root @ root.T
        name = form or regressors.form.name
        return self._fitted(averaged(members), regressors.radial, name, error, M, evidence)

    def kernel_network(self, metric: Metric, error: float) -> Fitted:
        """Of a kernel layer, judged as it was without the samples held out."""
        X, Y, held = self.problem.X, self.problem.Y, self.split.unseen[0]
        layer = KernelLayer.fit(metric, X, Y, seed=self.seed)
        judged = KernelLayer.fit(metric, self.split.X, self.split.Y, seed=self.seed)
        M, spread = None, np.ones(len(held))
        if len(layer.centres) <= calibration.LARGEST:
            M, spread = calibration.kernel_covariance(layer), calibration.kernel_spread(judged, held)
        evidence = [Evidence(self._missed(judged.predict(held), self.split), spread)]
        arrays = (*layer.units(), layer.weights, layer.tail)
        return self._fitted(arrays, metric.radial, "kernel layer", error, M, evidence)

    def evidence(self, found: Refined, split: Split) -> Evidence:
        """What a network that learnt from a split's samples misses on those held out."""
        held = split.unseen[0]
        root = calibration.regressor_root(found, split.X)
        return Evidence(self._missed(found.predict(held), split), calibration.spread_of(found, root, held))

    def _own(self, members: Sequence[Member], error: float) -> Evidence:
        """Each member's own held-out errors, less by what their average is expected to gain."""
        single = float(np.sqrt(np.mean([member.heldout**2 for member in members])))
        parts = [self.evidence(m.before, m.split) for m in members if m.before and m.split]
        return Evidence.together(parts, min(1.0, error / max(single, 1e-300)))

    def _missed(self, latent: np.ndarray, split: Split) -> np.ndarray:
        """Errors (N', m) in scaled outputs of latent ones (N', k) at the held-out samples."""
        wanted = self.problem.scaling.scale_outputs(self.samples.Y[split.held])
        return np.asarray(wanted - latent @ self.problem.basis)

    def _fitted(
        self,
        arrays: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
        radial: RadialFunction,
        form: str,
        error: float,
        M: np.ndarray | None,
        evidence: Sequence[Evidence],
    ) -> Fitted:
        heldout = float(error / self.problem.unit)
        network = self.problem.network(*arrays, radial, heldout=heldout)
        return Fitted(
            network,
            form,
            radial,
            network.units,
            heldout,
            tuple(self.trials),
            time.monotonic() - self.began,
            calibration.calibrated(network, M, evidence, self.level),
            TrainedRegion.of(self.problem.X),
            self.level,
            self.samples.one_output,
        )
