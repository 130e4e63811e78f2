"""Interactions: actions on a body that vary from solve to solve, as terms of its energy.

One law serves all interactions. With inputs q, state z (displacement and, in mixed form, pressure) and

    Π(z; q) = W(z) + Σ ∫ φ(u; q) - Σ qᵢ lᵢ·z,    z = z_free + z_base + Σ qᵢ Lᵢ on constrained unknowns,

the energy is U(q) = min Π - Π without the interaction, its generalised force -∂U/∂q = -∂Π/∂q by the envelope
theorem, and the derivative of that force -(D - Bᵀ K⁻¹ B) with B = ∂²Π/∂z∂q, D = ∂²Π/∂q², K = ∂²Π/∂z². So an
interaction has only to give its densities φ, its load vectors l or its lifts L: the derivatives follow.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.format import number
from palpate.physics.stop import Verdict

if TYPE_CHECKING:
    from palpate.physics.shapes.mesh import BodyMesh
    from palpate.physics.shapes.meshing import FineMesh
    from palpate.units import Range

__all__ = ["Attached", "Energy", "Field", "Fixed", "Interaction", "PlainInteraction", "Planned"]


class Field(Protocol):
    """The opened displacement field of a body, to which an interaction attaches.

    Attributes
    ----------
    mesh : ngsolve.Mesh
        The finite-element mesh.
    rest : BodyMesh
        The same mesh as plain arrays, its nodes the mesh's vertices.
    space : ngsolve.FESpace
        Space of all unknowns z, displacement first; its second component, where there is one, is the pressure.
    trial : ngsolve.CoefficientFunction
        The displacement u (3,) as the unknown, for use in a density.
    displacement : ngsolve.GridFunction
        u (3,) in m of the state under inspection.
    base : ngsolve.GridFunction
        u (3,) in m of the body under its constant loads alone: zero while attaching, filled in afterwards.
    """

    mesh: Any
    rest: BodyMesh
    space: Any
    trial: Any
    displacement: Any
    base: Any

    @property
    def size(self) -> int:
        """Number of all unknowns."""

    def surface(self, name: str) -> Any:
        """Return the NGSolve region of a named surface; `UsageError` if there is none."""

    def surface_dofs(self, name: str) -> np.ndarray:
        """Return a mask of the displacements on a named surface, bool of shape (dof,)."""

    def at_nodes(self, field: Any = None) -> np.ndarray:
        """Return values (node, 3) in m of `displacement`, or of another such grid function, at the mesh's vertices."""

    def interpolate(self, displacement: Any) -> np.ndarray:
        """Return unknowns (dof,) of a displacement given as a coefficient function (3,), on the whole body."""

    def load(self, integrand: Callable[[Any], Any]) -> np.ndarray:
        """Return the load vector l (dof,) of a linear form, given as a function of the test displacement v."""


@dataclass(frozen=True, eq=False)
class Energy:
    """A term ∫ φ of the energy.

    Attributes
    ----------
    density : ngsolve.CoefficientFunction
        φ in J/m² or J/m³ of `Field.trial` and of the interaction's parameters. Where a state is not admissible it
        is to be `BEYOND`.
    measure : ngsolve.comp.DifferentialSymbol
        ``ds(definedon=..., bonus_intorder=...)`` or ``dx(...)``.
    """

    density: Any
    measure: Any


BEYOND = 1e200  # J/m²: a density that no line search accepts, finite so that sums and derivatives stay so


def _nothing(_: np.ndarray) -> Verdict:
    return Verdict()


@dataclass(frozen=True, eq=False)
class Attached:
    """An interaction on an opened body.

    Attributes
    ----------
    parameters : tuple of ngsolve.Parameter
        One per input, read by the densities; the solver sets them.
    energies : tuple of Energy
        Its terms of the energy.
    loads : (n, dof) array, optional
        Vectors lᵢ: the energy is less by qᵢ lᵢ·z.
    lifts : (n, dof) array, optional
        Rows Lᵢ that one unit of each input adds to the constrained unknowns.
    constrained : (dof,) bool array, optional
        True for the unknowns that it constrains, to their base state plus lifts.
    inspect : callable
        Verdict on the state in `Field.displacement` under inputs (n,), independent of how it was found.
    approach : callable
        Leads from inputs (n,) to inputs (n,) at which the interaction leaves the body alone and from which a straight
        line leads to the former: the path along which the equilibrium is followed. None where there is none.
    distance : callable, optional
        Length that says how dear it is to go from one vector of inputs (n,) to another, on the scale of
        going straight from `approach`; by default the Euclidean length.
    first_step : float
        Longest first step along a path, as such a length; later ones adapt.
    shifts : (energies, 3 or more, dof) array, optional
        For energies of Rᵀ(X + u − p) alone, as a rigid tool's, whose place p moves with the first inputs: of each
        energy, the unknowns of the constant displacement by which one unit of each input moves p. The energy changes
        with p as it does with the unknowns the other way, so all its derivatives by inputs follow from those by
        unknowns, and none is taken symbolically.
    turns : callable, optional
        Gives for unknowns (dof,) and inputs (n,) the unknowns (3, dof) by which the displaced body turns rigidly about
        x, y and z through the tool's place: the torque on the tool is what its energies change by.
    rates : callable, optional
        Gives for inputs (n,) the turn (n − 3, 3) of a single tool about x, y and z by one unit of each further input.
    stiffen : callable, optional
        Gives a very stiff pad a share of its stiffness, 1 after attaching: a path is easier under a softer one.
    """

    parameters: tuple[Any, ...]
    energies: tuple[Energy, ...] = ()
    loads: np.ndarray | None = None
    lifts: np.ndarray | None = None
    constrained: np.ndarray | None = None
    inspect: Callable[[np.ndarray], Verdict] = _nothing
    approach: Callable[[np.ndarray], np.ndarray | None] = np.zeros_like
    distance: Callable[[np.ndarray, np.ndarray], float] | None = None
    first_step: float = np.inf
    shifts: np.ndarray | None = None
    turns: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None
    rates: Callable[[np.ndarray], np.ndarray] | None = None
    stiffen: Callable[[float], None] | None = None


@runtime_checkable
class Interaction(Protocol):
    """An action on a body, with n inputs: a frozen value that can be hashed and pickled."""

    def ranges(self, geometry: Any) -> tuple[Range, ...]:
        """Return name, range and unit of each input on a body of this geometry."""

    def describe(self) -> dict[str, Any]:
        """Return everything that decides its energy, as plain data for a JSON file, with a ``"type"``."""

    def refinements(self, geometry: Any) -> tuple[FineMesh, ...]:
        """Return the places where it needs a fine mesh."""

    def attach(self, field: Field) -> Attached:
        """Return its terms on an opened body.

        Raises
        ------
        UsageError
            If the body has no such surface.
        """


class PlainInteraction:
    """Base of interactions that are dataclasses: their fields are all that decides their energy."""

    def describe(self) -> dict[str, Any]:
        """Return everything that decides its energy, as plain data for a JSON file."""
        return {"type": type(self).__name__, **asdict(self)}  # type: ignore[call-overload]  # a subclass is a dataclass

    def refinements(self, geometry: Any) -> tuple[FineMesh, ...]:
        """Return the places where it needs a fine mesh: none, unless it says so."""
        return ()


@runtime_checkable
class Planned(Protocol):
    """An interaction that knows in which order its inputs are solved best."""

    def design(self, geometry: Any, samples: int, seed: int) -> np.ndarray:
        """Return inputs (samples, n) in an order of good chains."""

    def chains(self, geometry: Any, points: np.ndarray) -> list[np.ndarray]:
        """Return rows of `points` (N, n) to be solved one after the other, chain by chain."""


@dataclass(frozen=True)
class Fixed:
    """An interaction with fixed inputs, which is always there, such as a pre-stress or a support.

    Attributes
    ----------
    interaction : Interaction
        The interaction that acts.
    values : tuple of float
        Its inputs in SI units; a single number will do for one.

    Raises
    ------
    UsageError
        If it is no interaction, or the values are no numbers.
    """

    interaction: Interaction
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        if not isinstance(self.interaction, Interaction):
            raise UsageError(
                f"{self.interaction!r} can't be fixed: it is no interaction.",
                why="An interaction has ranges, describe, refinements and attach.",
                fix='For example Fixed(PrescribedDisplacement("top", "z", (-0.01, 0.0)), -0.004).',
            )
        values = tuple(self.values) if isinstance(self.values, Iterable) else (self.values,)
        for value in values:
            checks.finite("A fixed input", value)
        object.__setattr__(self, "values", values)

    def __str__(self) -> str:
        return f"{self.interaction}, at {', '.join(map(number, self.values))}"
