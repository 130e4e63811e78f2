"""What every energy that a hand feels answers: energy, force, stiffness, whether and how far it may be trusted.

Where its inputs are and what they mean (a probe's centre, a pad's displacement) is told by the surrogate itself; the
kernels of both fill the same answer (`touch_kernels`).
"""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from palpate.errors import UsageError
from palpate.format import share
from palpate.network import Network
from palpate.processes import available_cores
from palpate.surrogates.arguments import rows_of
from palpate.surrogates.touch_kernels import ANSWER, FORCE, STIFFNESS
from palpate.surrogates.touch_trust import covariances_into, trusts_into
from palpate.units import Range

__all__ = ["LearntEnergy", "corrected_by", "history_in_words", "warning_of"]

_PART = 2000  # answers that are worth a thread: about 10 ms


class LearntEnergy(ABC):
    """An energy U of n inputs x, the first three of them places in m whose force −∂U/∂x is felt."""

    WORDS: ClassVar[str]
    network: Network
    root: np.ndarray | None
    meta: Mapping[str, Any]

    @property
    def inputs(self) -> tuple[Range, ...]:
        """Names and trained ranges of all inputs: three coordinates (m), then the further ones."""
        return self.network.inputs

    @property
    def parameters(self) -> tuple[Range, ...]:
        """The inputs after the first three."""
        return self.network.inputs[3:]

    @abstractmethod
    def compiled(self) -> tuple[Any, ...]:
        """What the kernel takes after its answer, with scratch for one thread; the network's arrays last."""

    @abstractmethod
    def _fill(self, X: np.ndarray, answers: np.ndarray, inside: np.ndarray) -> None:
        """Answers (N, 14) and inside (N,) of inputs X (N, n)."""

    def _answers(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Checked inputs (N, n), answers (N, 14) and inside (N,)."""
        X = rows_of(X, self.inputs, self.WORDS)
        answers, inside = np.empty((len(X), ANSWER)), np.empty(len(X), dtype=np.bool_)
        parts = max(1, min(available_cores(), len(X) // _PART))
        if parts == 1:
            self._fill(X, answers, inside)
            return X, answers, inside
        ends = np.linspace(0, len(X), parts + 1).astype(int)
        some = [slice(a, b) for a, b in itertools.pairwise(ends)]
        with ThreadPoolExecutor(parts) as threads:  # the kernels need no lock of the interpreter
            list(threads.map(lambda one: self._fill(X[one], answers[one], inside[one]), some))
        return X, answers, inside

    def energy(self, X: np.ndarray) -> np.ndarray:
        """U (N,) at inputs X (N, n), J: what the hand gave on its way there.

        Raises
        ------
        UsageError
            If X has another number of columns, or holds what is no finite number; so do all that take X.
        """
        return self._answers(X)[1][:, 0].copy()

    def force(self, X: np.ndarray) -> np.ndarray:
        """F = −∂U/∂x (N, 3) by the first three inputs, N."""
        return self._answers(X)[1][:, FORCE].copy()

    def stiffness(self, X: np.ndarray) -> np.ndarray:
        """∂F/∂x (N, 3, 3), symmetric, N/m; a body that resists has negative eigenvalues."""
        return self._answers(X)[1][:, STIFFNESS].reshape(-1, 3, 3).copy()

    def inside(self, X: np.ndarray) -> np.ndarray:
        """Whether the answers (N,) are of the trained region: in all ranges, and near a training input.

        Without contact a touch's answer, zero, is exact, and counts as inside.
        """
        return self._answers(X)[2]

    def deviation(self, X: np.ndarray) -> np.ndarray:
        """Standard deviation (N,) of the force relative to its size; zero where there is none.

        Raises
        ------
        UsageError
            If the surrogate has no posterior.
        """
        return self._by_posterior(X, trusts_into, ())

    def force_covariance(self, X: np.ndarray) -> np.ndarray:
        """Covariance (N, 3, 3) of the force, N²: how far it may be off in which direction; zero where there is none.

        First order in the weights; its trace is (deviation · ‖F‖)².

        Raises
        ------
        UsageError
            If the surrogate has no posterior.
        """
        return self._by_posterior(X, covariances_into, (3, 3))

    def _by_posterior(self, X: np.ndarray, kernel: Callable[..., None], shape: tuple[int, ...]) -> np.ndarray:
        """What a kernel of `touch_trust` finds for each row, (N, *shape)."""
        if self.root is None:
            raise UsageError(
                "This surrogate does not know its deviation.",
                why="It has no posterior of its weights.",
                fix="Learn it with one, or give `root`.",
            )
        X, answers, _ = self._answers(X)
        root, net = self._compiled_posterior()
        out, columns = np.empty((len(X), *shape)), np.zeros((4, root.shape[1]))
        kernel(X, answers, out, root, columns, net)
        return out

    def _compiled_posterior(self) -> tuple[np.ndarray, tuple[Any, ...]]:
        """Root and network that the kernels of trust take, with scratch for one thread."""
        root, network = self._posterior
        return root, network.compiled()

    @cached_property
    def _posterior(self) -> tuple[np.ndarray, Network]:
        """The posterior's root (1 + n + k, z) in units of ℓ, (0, 0) without one, and the network of its k units.

        Of a mean of networks only the first one's units have a covariance.
        """
        if self.root is None:
            return np.zeros((0, 0)), self.network
        tail = 1 + len(self.inputs)
        units = np.flatnonzero(self.root[tail:].any(axis=1))
        count = 1 + int(units.max()) if units.size else 0
        some = replace(
            self.network,
            factors=self.network.factors[:count],
            shifts=self.network.shifts[:count],
            weights=self.network.weights[:, :count],
        )
        return self.root[: tail + count] * self.network.scaling.output_scale[0], some


def history_in_words(meta: Mapping[str, Any]) -> str:
    """What `meta` tells of the training."""
    words = ""
    if "solves" in meta:
        words += f"; trained with {meta['solves']} solves"
        if meta.get("samples", meta["solves"]) != meta["solves"]:
            words += f" ({meta['samples']} samples by symmetry)"
    error = meta.get("force_error")
    if isinstance(error, Mapping) and {"median", "p95"} <= error.keys():
        words += f"; force error {share(error['median'])} median, {share(error['p95'])} p95"
    if (touches := corrected_by(meta)) is not None:
        words += f"; corrected by {touches} measured touches"
        words += ", with a warning" if warning_of(meta) else ""
    return words + _memory_in_words(meta)


def _memory_in_words(meta: Mapping[str, Any]) -> str:
    """What the body does in the loop beyond its energy."""
    words = ""
    relaxation = meta.get("relaxation")
    if isinstance(relaxation, Mapping) and relaxation.get("terms"):
        shares = ", ".join(f"{100 * part:.3g} % in {seconds:.3g} s" for part, seconds in relaxation["terms"])
        words += f"; relaxes: {shares}"
    if isinstance(meta.get("yielding"), Mapping):
        words += "; yields and keeps prints"
    return words


def corrected_by(meta: Mapping[str, Any]) -> int | None:
    """How many measured touches have corrected it; None for one as it was learnt."""
    told = meta.get("correction")
    counts = told.get("counts") if isinstance(told, Mapping) else None
    return int(counts.get("learnt", 0)) if isinstance(counts, Mapping) else None


def warning_of(meta: Mapping[str, Any]) -> str:
    """What was suspicious of the measurements that have corrected it, in words; "" if nothing was."""
    told = meta.get("correction")
    return str(told.get("warning", "")) if isinstance(told, Mapping) else ""
