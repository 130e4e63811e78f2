"""Solves of a touched body that a model has never seen, and what a model answers there: both as values."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.dataset import Dataset
from palpate.errors import UsageError
from palpate.learning.grasp.solves import HeldSolves
from palpate.surrogates import TouchSurrogate
from palpate.surrogates.grasp import GraspSurrogate
from palpate.units import Range

__all__ = ["TouchFunction", "TouchSolves"]

Answer = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class TouchSolves:
    """Solves of a body under a probe.

    Attributes
    ----------
    X : (N, n)
        Centre of the probe (m), then further inputs.
    force : (N, 3)
        F on the probe, N.
    energy : (N,), optional
        U, J; zero without contact.
    stiffness : (N, 3, 3), optional
        ∂F/∂c, N/m; not-a-number where unknown.

    Raises
    ------
    UsageError
        If shapes do not fit, there is no solve, or no solve has a force.
    """

    X: np.ndarray
    force: np.ndarray
    energy: np.ndarray | None = None
    stiffness: np.ndarray | None = None

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
        wanted = {"force": (3,), "energy": (), "stiffness": (3, 3)}
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
        """Which solves have a force (N,)."""
        return np.asarray(self.force.any(axis=1))

    def take(self, rows: np.ndarray) -> TouchSolves:
        """Some of the solves, by a mask or indices."""
        energy = None if self.energy is None else self.energy[rows]
        return TouchSolves(
            self.X[rows], self.force[rows], energy, None if self.stiffness is None else self.stiffness[rows]
        )

    @classmethod
    def of(cls, test: Dataset | TouchSolves, inputs: Sequence[Range]) -> TouchSolves:
        """The converged rows of a dataset, or solves as they are, for a model with these inputs.

        Raises
        ------
        UsageError
            If their inputs are others.
        """
        if isinstance(test, TouchSolves):
            _refuse_inputs([f"input {i}" for i in range(test.X.shape[1])], inputs, len(inputs))
            return test
        if [r.name for r in test.ranges] != (names := [r.name for r in inputs]) and {"d_x", "d_y", "d_z"} <= {
            name.split()[-1] for name in names
        }:
            held = HeldSolves.of(test)
            _refuse_inputs([r.name for r in held.inputs], inputs, names)
            return cls(held.X, held.force[:, :3], held.energy, held.stiffness[:, :3, :3])
        test = test.ok
        _refuse_inputs([r.name for r in test.ranges], inputs, [r.name for r in inputs])
        if not len(test):
            raise UsageError(
                "There is no converged solve to test with.", fix="Sweep some samples for testing."
            )
        known = "response_gradient" in test
        return cls(
            test.X,
            test.response[:, :3],
            test.potential_energy if "potential_energy" in test else None,
            test.response_gradient[:, :3, :3] if known else None,
        )


def _refuse_inputs(found: list[str], inputs: Sequence[Range], wanted: list[str] | int) -> None:
    if found == wanted or len(found) == wanted:
        return
    raise UsageError(
        f"The solves' inputs are {', '.join(found)}; the model takes {', '.join(r.name for r in inputs)}.",
        fix="Test with solves of the body that the model was learnt from.",
    )


@dataclass(frozen=True, eq=False)
class TouchFunction:
    """What can be asked of a touched body: a surrogate, or any function beside which it is to be judged.

    Attributes
    ----------
    name : str
    inputs : n ranges
    force : callable (N, n) → (N, 3)
        N.
    energy, stiffness, depth, inside, deviation : callable, optional
        (N, n) → (N,) in J, (N, 3, 3) in N/m, (N,) in m, (N,) bool, (N,) relative to the force. What is missing is
        not judged, and said not to be.
    units : int
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

    @classmethod
    def of(cls, model: TouchSurrogate | GraspSurrogate | TouchFunction) -> TouchFunction:
        """What a surrogate answers; a function as it is."""
        if isinstance(model, TouchFunction):
            return model
        touched = isinstance(model, TouchSurrogate)
        return cls(
            str(model.meta.get("name", "touch surrogate" if touched else "grasp surrogate")),
            model.inputs,
            model.force,
            model.energy,
            model.stiffness,
            model.depth if isinstance(model, TouchSurrogate) else None,
            model.inside,
            None if model.root is None else model.deviation,
            model.network.units,
        )

    def within(self, X: np.ndarray) -> np.ndarray:
        """Whether X (N, n) is trained: as the model says, else whether it lies in the ranges."""
        if self.inside is not None:
            return np.asarray(self.inside(X), dtype=bool)
        low, high = np.array([[r.low for r in self.inputs], [r.high for r in self.inputs]])
        return np.asarray(((low <= X) & (high >= X)).all(axis=1))
