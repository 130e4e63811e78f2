"""A constant: U + U₀ = U₀ exp ℓ, for a body whose place of rest moves with its other loads.

Where several loads act at the held node, or loads elsewhere are further inputs, no place of rest is the same for all
inputs, and no stiffness at rest says how the energy begins. The energy itself is smooth, and so is ln(1 + U/U₀).
U₀ is chosen a few times the largest energy of the solves.

A node that several loads can move is held through a spring of compliance C: the felt coordinate is the hand's place
h = w + C P and the energy U(w) + ½ C |P|². In the bare displacement w all loads along the body share one place, and
the energy has a cusp there (see `palpate.learning`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from palpate.checks import own_arrays
from palpate.errors import UsageError
from palpate.kernels import part
from palpate.surrogates.baselines.baseline import Baseline, register_baseline
from palpate.surrogates.baselines.graph_form import BaselineForm, Graph, Touch, Value, outer
from palpate.surrogates.energy_kernels import GRADIENT, HESSIAN, ROOT, VECTORS, Compiled
from palpate.surrogates.memories import Amplitude
from palpate.units import Range

__all__ = ["ConstantBaseline", "require_axes"]


@register_baseline
@dataclass(frozen=True, eq=False)
class ConstantBaseline(Baseline):
    """A constant energy, which is taken off again.

    Attributes
    ----------
    level : float
        U₀, J.
    axes : (k, 3)
        Unit directions of the felt coordinates, k from 1 to 3.
    compliance : float
        Compliance C of the spring through which the node is held, m/N; 0 for a node that is held itself.

    Raises
    ------
    UsageError
        If the energy is not positive, or the axes are no directions at right angles.
    """

    name: ClassVar[str] = "constant"
    holds: ClassVar[bool] = True
    share: ClassVar[float] = 0.1
    force_floor: ClassVar[float] = 0.05
    ridge: ClassVar[float] = 1e-13  # solves of beams carry no noise

    level: float
    axes: np.ndarray
    compliance: float = 0.0

    def __post_init__(self) -> None:
        own_arrays(self, "axes")
        require_axes(self.axes)
        if not (math.isfinite(self.level) and self.level > 0 and 0 <= self.compliance < math.inf):
            raise UsageError(
                f"A constant baseline of {self.level} J and a compliance of {self.compliance} m/N can't be.",
                fix="Give a positive energy, a few times the largest of the solves.",
            )

    def __str__(self) -> str:
        return f"constant baseline of {self.level:.3g} J"

    @property
    def directions(self) -> np.ndarray:
        """Unit directions D (k, 3) of the felt coordinates."""
        return self.axes

    @property
    def amplitude(self) -> Amplitude:
        """None: where the body rests depends on its other loads."""
        return "none"

    @property
    def offset(self) -> float:
        """Energy that is taken off U₀ κ, J."""
        return self.level

    def compiled(self) -> Compiled:
        """Return the kernels and their arguments."""
        return Compiled(None, (self.level,), enter=_enter)

    def graph_form(self, graph: Graph, place: Value, touch: Touch | None, xi: Value) -> BaselineForm:
        """Return the constant, for exporters of graphs."""
        zero = place * 0.0
        level = place.columns(0, 1) * 0.0 + self.level
        return BaselineForm(level, zero, outer(zero, zero), level * 0.0, zero)

    def c_source(self) -> str:
        """Return the kernels in C99."""
        return Path(__file__).with_suffix(".c").read_text("utf-8")

    def coordinate(self, X: np.ndarray) -> np.ndarray:
        """Return how far (N,) the hand is from where it was at rest, m."""
        return np.asarray(np.linalg.norm(X[:, : len(self.axes)], axis=1))

    def logarithm(
        self, X: np.ndarray, inputs: tuple[Range, ...]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return ln U₀ (N,) and its derivatives, all zero."""
        N, n = len(X), len(inputs)
        return np.full(N, math.log(self.level)), np.zeros((N, n)), np.zeros((N, n, n))


def require_axes(axes: np.ndarray) -> None:
    """Refuse what is no set of one to three unit directions at right angles, (k, 3)."""
    sound = axes.ndim == 2 and axes.shape[1] == 3 and 1 <= len(axes) <= 3 and np.isfinite(axes).all()
    if not (sound and np.allclose(axes @ axes.T, np.eye(len(axes)), atol=1e-9)):
        raise UsageError(
            f"Felt coordinates along {axes.tolist()} can't be.",
            why="They are one to three unit directions at right angles.",
            fix="Give the rows of a (k, 3) array, for example [[0, 1, 0]].",
        )


@part
def _enter(position, parameters, moved, base, small, numbers, args) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Fill a constant energy without derivatives."""
    base[0], base[2], base[3] = args[0], args[0], 0.0
    base[1] = math.sqrt(position[0] ** 2 + position[1] ** 2 + position[2] ** 2)
    small[VECTORS, GRADIENT, :] = 0.0
    small[ROOT, 0, :] = 0.0
    small[HESSIAN, :, :] = 0.0
    return True
