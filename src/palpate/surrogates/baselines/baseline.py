"""Baselines: the energy that a body is known to have before anything is learnt.

A learnt body's energy is U = U₀ κ − offset with κ = exp ℓ, ℓ a network. The baseline U₀ carries all that is singular
or known: that a probe in the air feels nothing, how a contact begins, how stiff a held body is at rest. To add a kind
of interaction is to write one baseline:

- `compiled` gives its kernels: U₀, ∇U₀ and ∇²U₀ at a place (see `palpate.surrogates.energy_kernels.Compiled`),
- `logarithm` gives ln(U₀) and its derivatives at many places, from which what is learnt is counted; by default it
  asks the kernel,
- `recognise` tells the datasets that it is for, and takes from them what learning needs,
- `register_baseline` makes it known, so that files and datasets find it by its name.

A baseline is a frozen dataclass whose fields are numbers, texts, arrays, other frozen dataclasses or None: with that it
is written to files and read back.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from palpate.errors import UsageError
from palpate.format import millimetres
from palpate.network.kinds import register_kind
from palpate.surrogates.baselines.graph_form import BaselineForm, Graph, Touch, Value
from palpate.surrogates.energy_kernels import GRADIENT, HESSIAN, SMALL, VECTORS, Compiled
from palpate.surrogates.memories import Amplitude
from palpate.surrogates.surface import TouchedSurface
from palpate.units import Range

__all__ = ["Baseline", "Solves", "baseline_class", "register_baseline", "registered_baselines"]

_SPACE = np.eye(3)
_SPACE.setflags(write=False)


@dataclass(frozen=True, eq=False)
class Solves:
    """Solves of a body that a hand moves, as learning takes them.

    Attributes
    ----------
    X : (N, n)
        Felt coordinates (m), one, two or three, then further inputs.
    energy : (N,)
        Energy U that the hand has given, J.
    force : (N, 3) or (N, n)
        Force −∂U/∂x by the felt coordinates, N; then −∂U/∂p by the further inputs, not-a-number where unknown.
    stiffness : (N, k, k) or (N, n, n), optional
        Derivative of the force; not-a-number where unknown.
    inputs : n ranges
        Names, units and trained ranges.
    symmetry : (m, 3, 3)
        Isometries of the body and all that acts on it: the whole group, the identity among them; empty without.
    about : (3,), optional
        The point that they leave where it is, m.
    axes : tuple of int
        Along which axes the inputs after the felt ones are coordinates of a place that turns with the body.
    angles : int
        How many inputs after the felt ones are components x, y, z of a rotation vector, which turns with the body.
    options : mapping
        Further arguments of `palpate.learning.learn_energy` that the data decides.
    """

    X: np.ndarray
    energy: np.ndarray
    force: np.ndarray
    stiffness: np.ndarray | None
    inputs: tuple[Range, ...]
    symmetry: np.ndarray = field(default_factory=lambda: np.zeros((0, 3, 3)))
    about: np.ndarray | None = None
    axes: tuple[int, ...] = ()
    angles: int = 0
    options: Mapping[str, Any] = field(default_factory=dict)


class Baseline(ABC):
    """The known part U₀ of an energy.

    Attributes
    ----------
    name : str
        The name by which files find it.
    holds : bool
        True where the hand holds a patch or a node, and x is its displacement from rest; False where the hand moves a
        free probe, and x is its centre.
    share : float
        How far beyond each trained range ℓ is followed, as a share of the range.
    further_share : float
        Weight of what is known by further inputs, beside that of energy and force.
    forces : int
        How many inputs after the felt ones have forces in N that count as the hand's do, such as the effort of jaws.
    force_floor : float
        Least force, as a share of the largest, relative to which errors of the force count.
    ridge : float
        Penalty on the network's squared weights, by the noise of such solves.
    """

    name: ClassVar[str]
    holds: ClassVar[bool] = False
    share: ClassVar[float] = 0.25
    further_share: ClassVar[float] = 1.0
    forces: ClassVar[int] = 0
    force_floor: ClassVar[float] = 0.0
    ridge: ClassVar[float] = 3e-6

    @abstractmethod
    def compiled(self) -> Compiled:
        """Return the kernels and their arguments, with scratch for one thread."""

    @property
    def c_name(self) -> str:
        """Name under which `c_source` defines its functions, by default its own."""
        return self.name

    @property
    def directions(self) -> np.ndarray:
        """Unit directions D (k, 3) of the felt coordinates; x, y and z by default."""
        return _SPACE

    @property
    def surface(self) -> TouchedSurface | None:
        """The touched surface at rest; None where nothing is touched."""
        return None

    @property
    def surfaces(self) -> tuple[TouchedSurface, ...]:
        """All fields of distances among the arguments of the kernels, the touched surface first."""
        return () if self.surface is None else (self.surface,)

    def with_surface(self, surface: TouchedSurface) -> Baseline:
        """Return the same baseline on another touched surface; itself where it has none."""
        return self

    def surface_shift(self, normal: np.ndarray) -> np.ndarray:
        """Return the way (3,), m, by which `surface` lies before the body's own of a normal (3,); zero by default."""
        return np.zeros(3)

    @property
    def radius(self) -> float:
        """Radius of the probe, m; not-a-number where there is none, or an input is it."""
        return math.nan

    @property
    def radius_input(self) -> int | None:
        """The input that is the probe's radius; None where none is."""
        return None

    @property
    def probe_words(self) -> str:
        """The probe in a few words, as "pressed by …" has it."""
        return "a ball" if math.isnan(self.radius) else f"a ball of radius {millimetres(self.radius)}"

    @property
    def amplitude(self) -> Amplitude:
        """Sign of the amplitude q that memories walk, U = ½ q².

        "positive" where q is √(2 U), "signed" where it changes its sign with the place, as along one direction, and
        "none" where the energy has no place of rest to count q from.
        """
        return "positive"

    @property
    def offset(self) -> float:
        """Energy that is taken off U₀ κ, J, so that the body at rest has none."""
        return 0.0

    @property
    def inner(self) -> float:
        """Depth of the probe's centre inside the touched surface at which the body lets go, m."""
        return math.inf

    def fault(self, inputs: tuple[Range, ...]) -> str:
        """Return what does not fit the network's inputs; "" if all does."""
        return "" if len(inputs) >= len(self.directions) else f"{len(inputs)} inputs are fewer than it feels"

    def logarithm(
        self, X: np.ndarray, inputs: tuple[Range, ...]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return ln U₀ (N,), its gradient (N, n) and its Hessian (N, n, n) by all inputs, at X (N, n).

        Not-a-number where a derivative is not known: by default those by further inputs.
        """
        del inputs
        k, parts = len(self.directions), self.compiled()
        N, n = X.shape
        value, gradient, hessian = np.empty(N), np.full((N, n), np.nan), np.full((N, n, n), np.nan)
        D, small = self.directions, np.zeros((SMALL, 3, 3))
        if parts.kernel is None:
            raise NotImplementedError(f"{type(self).__name__} gives `enter`, and so must give `logarithm`")
        for i, x in enumerate(X):
            g, H = small[VECTORS, GRADIENT], small[HESSIAN]
            U0, _ = parts.kernel(x[:k] @ D, x[k:], g, H, parts.args)
            by, twice = D @ g / U0, D @ H @ D.T / U0
            value[i], gradient[i, :k], hessian[i, :k, :k] = math.log(U0), by, twice - np.outer(by, by)
        return value, gradient, hessian

    def coordinate(self, X: np.ndarray) -> np.ndarray:
        """Return the baseline's own coordinate s (N,) at inputs X (N, n), m; no contact where s ≤ 0."""
        k, parts = len(self.directions), self.compiled()
        if parts.kernel is None:
            raise NotImplementedError(f"{type(self).__name__} gives `enter`, and so must give `coordinate`")
        small = np.zeros((SMALL, 3, 3))
        g, H = small[VECTORS, GRADIENT], small[HESSIAN]
        return np.array([parts.kernel(x[:k] @ self.directions, x[k:], g, H, parts.args)[1] for x in X])

    def stiffness_at_rest(self, X: np.ndarray, inputs: tuple[Range, ...]) -> np.ndarray:
        """Return the Hessian (N, k, k) of U₀ by the felt coordinates where it has no energy, at X (N, n), N/m."""
        raise NotImplementedError(f"{type(self).__name__} says no stiffness at rest")

    def row_weights(self, X: np.ndarray) -> np.ndarray:
        """Return how much each solve (N,) counts, beside others."""
        return np.ones(len(X))

    def groups(self, X: np.ndarray) -> np.ndarray:
        """Return the number (N,) of each solve's group: solves of one group are left out together."""
        return np.arange(len(X))

    def finest(self, inputs: tuple[Range, ...]) -> np.ndarray | None:
        """Return the shortest ways (n,) over which the energy can change, in the inputs' units; None where any."""
        del inputs
        return None

    def candidates(self) -> list[Baseline]:
        """Return the baselines of this kind among which learning chooses, the one that is kept in doubt first."""
        return [self]

    def c_source(self) -> str | None:
        """Return the kernels in C99 for exporters, which refuse a baseline without them by name.

        The text defines four functions, called as the name with ``_enter``, ``_rest``, ``_log`` and ``_leave``; the
        arrays of `compiled` are theirs in the same order (docs/guide/export.md, "A baseline of your own").
        """
        return None

    def graph_form(self, graph: Graph, place: Value, touch: Touch | None, xi: Value) -> BaselineForm:
        """Return U₀ and its derivatives by the place (N, 3), for exporters of graphs such as ONNX.

        `touch` is the probe at the baseline's surface where there is one, `xi` are the scaled inputs (N, n). By default
        there is none, and those exporters refuse the baseline by name.

        Raises
        ------
        UsageError
            Unless the baseline has such a form.
        """
        raise UsageError(
            f"The baseline {self.name!r} has no ONNX form.",
            why="Its formula is Python code that is compiled for this machine.",
            fix="Export a body under a probe, a pad or beam loads.",
        )

    def graph_exponent(self, graph: Graph, xi: Value, half: np.ndarray) -> tuple[Value, Value, Value] | None:
        """Return what ℓ has beside the network at scaled inputs (N, n), with first and second slopes; None by default.

        The slopes (N, k) and (N, k, k) are by the k felt inputs, whose ranges have half the widths `half`.
        """
        return None

    @classmethod
    def recognise(cls, data: Any) -> tuple[Baseline, Solves] | None:
        """Return a first baseline and the solves of a dataset; None for a dataset of another kind."""
        del data
        return None


_CLASSES: dict[str, type[Baseline]] = {}


def register_baseline(cls: type[Baseline]) -> type[Baseline]:
    """Make a baseline known by its name, to files and to `palpate.learn`; also a decorator.

    Parameters
    ----------
    cls : class
        A frozen dataclass derived from `Baseline`.

    Raises
    ------
    UsageError
        If it is no such class, has no name, or another one has it.
    """
    if not (
        isinstance(cls, type) and issubclass(cls, Baseline) and isinstance(getattr(cls, "name", None), str)
    ):
        raise UsageError(
            f"{cls!r} is no baseline.",
            why="A baseline derives from palpate.surrogates.Baseline and has a `name`.",
            fix='Write `class SpringBed(pp.Baseline): name = "spring-bed"`.',
        )
    register_kind(Baseline, cls)
    _CLASSES[cls.name] = cls
    return cls


def baseline_class(name: str) -> type[Baseline]:
    """Return the baseline of a name."""
    if name not in _CLASSES:
        raise UsageError(
            f"There is no baseline {name!r}.",
            why=f"Known are {', '.join(sorted(_CLASSES))}.",
            fix="Import the module that registers it first.",
        )
    return _CLASSES[name]


def registered_baselines() -> tuple[type[Baseline], ...]:
    """Return all registered baselines, those of palpate first."""
    return tuple(_CLASSES.values())
