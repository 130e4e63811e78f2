"""Unseen solves and the function of place that is asked beside them: both as values."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from palpate.dataset import Dataset
from palpate.errors import UsageError
from palpate.learning.pad_solves import is_padded, pad_solves
from palpate.surrogates import LearntEnergy, Surrogate
from palpate.surrogates.grip_effort import efforts
from palpate.tools.gripper import OPENING
from palpate.units import Range
from palpate.validation.limits import FAINT, FAINT_JND, FORCE_JND

__all__ = ["ForceSamples", "TouchFunction", "TouchSolves", "felt_force", "force_jnd"]

Answer = Callable[[np.ndarray], np.ndarray]


def force_jnd(size: np.ndarray) -> np.ndarray:
    """Return the just noticeable relative difference of forces of these sizes (N,), N."""
    return np.where(np.asarray(size) < FAINT, FAINT_JND, FORCE_JND)


@dataclass(frozen=True, eq=False)
class ForceSamples:
    """Forces on the hand or probe, asked for where each finite-element solve has it.

    Where is the centre of a probe; or coordinates along the touched loads, the held node's displacement plus the
    stretch of the virtual coupling.
    """

    hand: np.ndarray  # (N, k), where it is, m
    truth: np.ndarray  # (N, 3), of the finite-element solve, N; of two jaws (N, 4), with their effort
    answer: np.ndarray  # the same of the model, N
    inside: np.ndarray  # (N,) bool, the model called the place inside its trained range

    @property
    def size(self) -> np.ndarray:
        """Size ‖F‖ of the finite-element solves (N,), N."""
        return np.asarray(np.linalg.norm(self.truth, axis=1))

    @property
    def error(self) -> np.ndarray:
        """Error ‖ΔF‖ (N,), N."""
        return np.asarray(np.linalg.norm(self.answer - self.truth, axis=1))

    @property
    def light(self) -> float:
        """Force f₀ = min(0.5 N, 5 % of the largest ‖F‖): below it relative errors say little."""
        return float(min(0.5, 0.05 * self.size.max()))

    @property
    def heavy(self) -> np.ndarray:
        """Mask (N,) of the touches that are stronger than f₀."""
        return np.asarray(self.size > self.light)

    @property
    def relative(self) -> np.ndarray:
        """Relative error ‖ΔF‖/‖F‖ (N,); not-a-number without force, infinite where there should be none."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(self.error / self.size)

    @property
    def jnd(self) -> np.ndarray:
        """Error (N,) in just noticeable differences of a force of that size."""
        return np.asarray(self.relative / force_jnd(self.size))


@dataclass(frozen=True, eq=False)
class TouchSolves:
    """Solves of a body under a probe.

    Attributes
    ----------
    X : (N, n)
        Centre of the probe (m), then further inputs.
    force : (N, 3) or (N, 4)
        F on the probe, N; of two jaws the effort of their opening beside it.
    energy : (N,), optional
        U, J; zero without contact.
    stiffness : (N, 3, 3), optional
        ∂F/∂c, N/m; not-a-number where unknown.
    data : Dataset, optional
        The rows of the dataset that they are of, in their order.

    Raises
    ------
    UsageError
        If shapes do not fit, there is no solve, or no solve has a force.
    """

    X: np.ndarray
    force: np.ndarray
    energy: np.ndarray | None = None
    stiffness: np.ndarray | None = None
    data: Dataset | None = None

    def __post_init__(self) -> None:
        for name in ("X", "force", "energy", "stiffness"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, np.ascontiguousarray(value, dtype=np.float64))
        if fault := self._fault():
            raise UsageError(
                f"These solves can't judge a touch: {fault}.",
                why="Each needs where the probe was and what force it met.",
                fix="Give inputs (N, n), forces (N, 3), and if known energies (N,) and ∂F/∂c (N, 3, 3).",
            )

    def _fault(self) -> str:
        if self.X.ndim != 2 or self.X.shape[1] < 3 or not len(self.X):
            return f"their inputs have shape {self.X.shape}"
        wanted = {"force": self.force.shape[1:], "energy": (), "stiffness": (3, 3)}
        if wanted["force"] not in {(3,), (4,)}:
            return f"their force has shape {self.force.shape}"
        for name, rest in wanted.items():
            value = getattr(self, name)
            if value is not None and value.shape != (len(self.X), *rest):
                return f"their {name} has shape {value.shape} for {len(self.X)} inputs"
        if not (np.isfinite(self.X).all() and np.isfinite(self.force).all()):
            return "inputs or forces are not finite"
        return "" if self.force.any() else "none has a force"

    def __len__(self) -> int:
        return len(self.X)

    @property
    def touching(self) -> np.ndarray:
        """Mask (N,) of the solves that have a force."""
        return np.asarray(self.force.any(axis=1))

    def take(self, rows: np.ndarray) -> TouchSolves:
        """Return some of the solves, by a mask or indices."""
        energy = None if self.energy is None else self.energy[rows]
        stiffness = None if self.stiffness is None else self.stiffness[rows]
        data = None if self.data is None else self.data.take(np.arange(len(self))[rows])
        return TouchSolves(self.X[rows], self.force[rows], energy, stiffness, data)

    @classmethod
    def of(cls, test: Dataset | TouchSolves, inputs: Sequence[Range]) -> TouchSolves:
        """Return the converged rows of a dataset, or solves as they are, for a model with these inputs.

        Raises
        ------
        UsageError
            If their inputs are others.
        """
        if isinstance(test, TouchSolves):
            _refuse_inputs([f"input {i}" for i in range(test.X.shape[1])], inputs, len(inputs))
            return test
        if is_padded(test):
            held = pad_solves(test)
            _refuse_inputs([r.name for r in held.inputs], inputs, [r.name for r in inputs])
            known = None if held.stiffness is None else held.stiffness[:, :3, :3]
            return cls(held.X, held.force[:, :3], held.energy, known, test.ok)
        test = test.ok
        _refuse_inputs([r.name for r in test.ranges], inputs, [r.name for r in inputs])
        if not len(test):
            raise UsageError(
                "There is no converged solve to test with.", fix="Sweep some samples for testing."
            )
        gradient = "response_gradient" in test
        return cls(
            test.X,
            test.response[:, : 3 + _has_opening(test.ranges)],
            test.potential_energy if "potential_energy" in test else None,
            test.response_gradient[:, :3, :3] if gradient else None,
            test,
        )


def _refuse_inputs(found: list[str], inputs: Sequence[Range], wanted: list[str] | int) -> None:
    if found == wanted or len(found) == wanted:
        return
    raise UsageError(
        f"The solves' inputs are {', '.join(found)}; the model takes {', '.join(r.name for r in inputs)}.",
        fix="Test with solves of the body that the model was learnt from.",
    )


def felt_force(energy: LearntEnergy, X: np.ndarray) -> np.ndarray:
    """Return the force (N, 3) in N at inputs X (N, n); of two jaws with their effort (N, 4)."""
    force = energy.force(X)
    return np.column_stack([force, efforts(energy, X)]) if _has_opening(energy.inputs) else force


def _has_opening(inputs: Sequence[Range]) -> bool:
    return OPENING in {r.name for r in inputs}


@dataclass(frozen=True, eq=False)
class TouchFunction:
    """Function of place that answers the force: that of a surrogate, or any other beside which it is judged.

    Attributes
    ----------
    name : str
        Name in tables and headings.
    inputs : n ranges
        Names, trained ranges and units of the inputs; the first three are coordinates in m.
    force : callable (N, n) → (N, 3) or (N, 4)
        N; of two jaws with their effort.
    energy, stiffness, depth, inside, deviation : callable, optional
        (N, n) → (N,) in J, (N, 3, 3) in N/m, (N,) in m, (N,) bool, (N,) relative to the force. What is missing is
        not judged, and said not to be.
    units : int
        Units of the network that answers.
    holds : bool
        True if the hand holds the body and x is its displacement from rest; False if x is the centre of a probe.
    """

    name: str
    inputs: tuple[Range, ...]
    force: Answer
    energy: Answer | None = None
    stiffness: Answer | None = None
    depth: Answer | None = None
    inside: Answer | None = None
    deviation: Answer | None = None
    units: int = 0
    holds: bool = False

    @classmethod
    def of(cls, model: Surrogate | TouchFunction) -> TouchFunction:
        """Return the function that a surrogate answers; a function as it is."""
        if isinstance(model, TouchFunction):
            return model
        energy = model.hand_energy
        return cls(
            model.name,
            energy.inputs,
            partial(felt_force, energy),
            energy.energy,
            energy.stiffness,
            None if energy.baseline.holds else energy.depth,
            energy.inside,
            None if energy.root is None else energy.deviation,
            energy.network.units,
            holds=energy.baseline.holds,
        )

    def within(self, X: np.ndarray) -> np.ndarray:
        """Return whether inputs X (N, n) are trained: as the model says, else whether they lie in the ranges."""
        if self.inside is not None:
            return np.asarray(self.inside(X), dtype=bool)
        low, high = np.array([[r.low for r in self.inputs], [r.high for r in self.inputs]])
        return np.asarray(((low <= X) & (high >= X)).all(axis=1))
