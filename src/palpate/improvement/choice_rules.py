"""Rules that choose the next solves among candidates.

*Variance.* The candidates also stand for the places where the hand may go. A solve at the rows g of a candidate lowers
the sum of the expected squared relative force errors over all places r,

    Σ_r tr(A_r P_rr A_rᵀ),        by        tr(Z (P_gg + N_g)⁻¹ Zᵀ),   Z = A P_rg

P the posterior covariance of value and slopes, N the noise (Sacks, Welch, Mitchell & Wynn 1989; Cohn, Ghahramani &
Jordan 1996). The best fall for its cost is taken, P is conditioned on it, which needs no answer of the solver, and the
next is chosen.

*Farthest.* The place farthest from all that were chosen, images counted (Kennard & Stone 1969). It needs no model.

*Disagreement.* The place where models that each lack a part of the solves disagree most (Seung, Opper & Sompolinsky
1992), less where a batch has a place nearby already.

References: J. Sacks, W. J. Welch, T. J. Mitchell, H. P. Wynn (1989), Stat. Sci. 4, 409–423. D. A. Cohn, Z. Ghahramani,
M. I. Jordan (1996), JAIR 4, 129–145. R. W. Kennard, L. A. Stone (1969), Technometrics 11, 137–148. H. S. Seung,
M. Opper, H. Sompolinsky (1992), COLT, 287–294.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from palpate.improvement.force_model import ForceModel
from palpate.learning.gradient_process import GradientProcess
from palpate.rbf.symmetric_units import Images

__all__ = [
    "VarianceChoice",
    "choose_by_disagreement",
    "choose_by_variance",
    "choose_farthest",
    "image_distances",
]

FARTHEST_EVERY = 4  # picks of which one is the farthest place: an insurance against a wrong process
_PARTS = 5  # parts of the solves, one of which each disagreeing model lacks


@dataclass(eq=False)
class VarianceChoice:
    """The state of the greedy choice by variance: the posterior, brought up to date after every pick."""

    P: np.ndarray  # (C·m, C·m), posterior covariance of m = 1 + n values and slopes at C places
    W: np.ndarray  # (C·k, C·m), A P: how an error of the force goes with value and slopes
    noise: np.ndarray  # (C, m), noise variance of a solve's answers; infinite where it does not answer

    @classmethod
    def of(
        cls, process: GradientProcess, X: np.ndarray, maps: np.ndarray, weights: np.ndarray
    ) -> VarianceChoice:
        """Return the state before the first pick, from a process conditioned on what is solved.

        X (C, n) are scaled inputs of the places, `maps` (C, k, m) is A, `weights` (C, m) are those of a solve's
        answers.
        """
        P = process.posterior(X)
        C, k, m = maps.shape
        W = np.einsum("ckm,cmx->ckx", maps, P.reshape(C, m, C * m), optimize=True).reshape(C * k, C * m)
        return cls(P, W, process.noise_variance(weights))

    def falls(self, groups: np.ndarray) -> np.ndarray:
        """Return the fall (g,) of the summed squared error by a solve of each group of places (g, rows)."""
        m = self.noise.shape[1]
        columns = (m * groups[:, :, None] + np.arange(m)).reshape(len(groups), -1)
        noise = self.noise[groups].reshape(len(groups), -1)
        Z = self.W[:, columns]
        S = self.P[columns[:, :, None], columns[:, None, :]]
        # an answer without weight tells nothing: its row and column are taken out of the update
        silent = ~np.isfinite(noise)
        Z = np.where(silent[None], 0.0, Z)
        S = np.where(silent[:, :, None] | silent[:, None, :], 0.0, S)
        own = np.arange(columns.shape[1])
        S[:, own, own] += np.where(silent, 1.0, noise)
        products = np.einsum("xga,xgb->gab", Z, Z, optimize=True)
        return np.asarray(np.trace(np.linalg.solve(S, products), axis1=1, axis2=2))

    def condition(self, rows: np.ndarray) -> None:
        """Condition the posterior on solves at some places (rows,), whatever they will answer."""
        m = self.noise.shape[1]
        columns = (m * np.asarray(rows)[:, None] + np.arange(m)).ravel()
        noise = self.noise[rows].ravel()
        columns, noise = columns[np.isfinite(noise)], noise[np.isfinite(noise)]
        S = self.P[np.ix_(columns, columns)] + np.diag(noise)
        gain = np.linalg.solve(S, self.P[columns])
        self.W -= self.W[:, columns] @ gain
        self.P -= self.P[:, columns] @ gain


def choose_by_variance(
    model: ForceModel,
    X: np.ndarray,
    groups: Sequence[np.ndarray],
    costs: np.ndarray,
    count: int,
    *,
    taken: np.ndarray,
    failed: np.ndarray | None = None,
    interest: np.ndarray | None = None,
    farthest_every: int = FARTHEST_EVERY,
    largest: bool = False,
) -> list[int]:
    """Return the numbers of at most `count` groups, the best first.

    X (C, n) are the inputs of the candidates, all in contact, in their own units; groups are rows of X that are solved
    together: single ones, or depth series. `costs` (G,) of the groups have any unit; `interest` (C,) weighs the squared
    error at each candidate, by default all the same.

    `taken` (T, n) were solved or tried, and from them the farthest are counted: one pick in `farthest_every` is the
    farthest, 0 for none. The inputs `failed` (F, n) in contact, whose solves failed, count as if they had answered, so
    that no others are chosen beside them. `largest` takes the largest expected error at the group itself in place of
    the fall over all places (MacKay 1992), the rival that needs no integral.
    """
    places = X if failed is None else np.concatenate([X, failed])
    maps = model.error_maps(places)
    maps[len(X) :] = 0.0
    if interest is not None:
        maps[: len(X)] *= np.sqrt(np.maximum(interest, 0.0))[:, None, None]
    state = VarianceChoice.of(model.process, model.scaled(places), maps, model.weights(places))
    if len(places) > len(X):
        state.condition(np.arange(len(X), len(places)))
    sizes = np.array([len(g) for g in groups])
    left = np.ones(len(groups), dtype=bool)
    chosen: list[int] = []
    for _ in range(min(count, len(groups))):
        if farthest_every and len(chosen) % farthest_every == farthest_every - 1:
            so_far = [taken, *(X[groups[g]] for g in chosen)]
            pick = _farthest_group(model, X, groups, left, np.concatenate(so_far))
        else:
            score = np.full(len(groups), -np.inf)
            for size in np.unique(sizes[left]):
                some = np.flatnonzero(left & (sizes == size)).tolist()
                rows = np.array([groups[g] for g in some])
                value = _own_errors(state, maps, rows) if largest else state.falls(rows)
                score[some] = value / costs[some]
            pick = int(np.argmax(score))
        chosen.append(pick)
        left[pick] = False
        state.condition(groups[pick])
    return chosen


def _own_errors(state: VarianceChoice, maps: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Return the mean expected squared error (g,) at the places of each group."""
    C, m = state.noise.shape
    P = state.P.reshape(C, m, C, m)[np.arange(C), :, np.arange(C)]
    own = np.einsum("ckm,cmx,ckx->c", maps, P, maps, optimize=True)
    return np.asarray(own[groups].mean(axis=1))


def _farthest_group(
    model: ForceModel, X: np.ndarray, groups: Sequence[np.ndarray], left: np.ndarray, taken: np.ndarray
) -> int:
    """Return the group left whose first place is farthest from all that are taken."""
    firsts = model.scaled(X[[g[0] for g in groups]])
    distance = image_distances(firsts, model.scaled(taken), model.half, model.images).min(axis=1)
    return int(np.argmax(np.where(left, distance, -np.inf)))


def image_distances(A: np.ndarray, B: np.ndarray, half: np.ndarray, images: Images) -> np.ndarray:
    """Return the distance (N, P) of places A (N, n) from the nearest image of places B (P, n), all scaled inputs.

    Positions count in metres; a further input counts as much over its range as the position does over its mean range.
    `half` (n,) is half of each input's range; the group of images acts on scaled inputs.
    """
    sizes = np.concatenate([half[:3], np.full(len(half) - 3, half[:3].mean())])
    least = np.full((len(A), len(B)), np.inf)
    for image in images.of(B):
        least = np.minimum(least, np.linalg.norm((A[:, None] - image[None]) * sizes, axis=2))
    return least


def choose_farthest(
    X: np.ndarray, taken: np.ndarray, half: np.ndarray, images: Images, count: int
) -> list[int]:
    """Return the numbers of `count` places of X (C, n), each farthest from `taken` (T, n) and those before it.

    Inputs are scaled; `half` is half of each range, and `images` the group.
    """
    distance = image_distances(X, taken, half, images).min(axis=1)
    chosen: list[int] = []
    for _ in range(min(count, len(X))):
        pick = int(np.argmax(distance))
        chosen.append(pick)
        distance = np.minimum(distance, image_distances(X, X[[pick]], half, images)[:, 0])
        distance[chosen] = -np.inf
    return chosen


def choose_by_disagreement(model: ForceModel, X: np.ndarray, count: int) -> list[int]:
    """Return the numbers of `count` places of X (C, n) where models without a fifth of the solves disagree most.

    Within a batch a place counts less the nearer it is to one chosen before, within the mean distance of the solves.
    The places are all in contact, in their own units; the models without a fifth have the lengths of the whole one.
    """
    seen, process = model.process.seen, model.process
    part = np.arange(len(seen)) % _PARTS
    forces = np.array(
        [
            replace(model, process=replace(process, seen=seen.take(part != k))).force(X)
            for k in range(min(_PARTS, len(seen)))
        ]
    )
    mean = forces.mean(axis=0)
    spread = np.sqrt(np.square(forces - mean).sum(axis=2).mean(axis=0))
    score = spread / np.maximum(np.linalg.norm(mean, axis=1), 0.05 * model.largest)
    scaled, half = model.scaled(X), model.half
    reach = 2.0 * float(np.prod(half[:3]) ** (1.0 / 3.0)) / max(1.0, len(seen) ** (1.0 / 3.0))
    chosen: list[int] = []
    for _ in range(min(count, len(X))):
        pick = int(np.argmax(score))
        chosen.append(pick)
        near = image_distances(scaled, scaled[[pick]], half, model.images)[:, 0]
        score = score * np.minimum(1.0, near / reach)
        score[chosen] = -np.inf
    return chosen
