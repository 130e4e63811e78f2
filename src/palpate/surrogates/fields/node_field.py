"""A field at the nodes of a body that loads bend: for the eye, and for the founding question of loads in, nodes out.

    y(X)      at each node, of the loads X that hold the body there, or of place and load of a rod with a memory

A beam whose one load acts across it and begins at zero is learnt for one sign of the load; the other side is its mirror
image. Beyond the trained ranges the field is that at their edge: the network knows nothing farther out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np

from palpate.checks import own_arrays
from palpate.errors import UsageError
from palpate.format import count
from palpate.kernels import kernel
from palpate.network import Network
from palpate.network.kinds import register_kind
from palpate.network.network_kernels import point_into
from palpate.surrogates.fields.field import Field
from palpate.units import bounds

if TYPE_CHECKING:
    from palpate.surrogates.energy import LearntEnergy

__all__ = ["NodeEvaluator", "NodeField"]

AskedBy = Literal["load", "place and load"]


@dataclass(frozen=True, eq=False, repr=False)
class NodeField(Field):
    """A field at nodes as a value, kept in the file of its body.

    Attributes
    ----------
    name, unit : str
        What it is called, and the unit of its values.
    network : Network
        Loads in N, or the held node's place along the touched loads in m and all loads → values, one output for each
        of the columns.
    columns : (m, 2) int
        Node and component that each output is of; what has no output does not move.
    points : (nodes, 3)
        The nodes at rest, m.
    held : int
        The node that the hand holds.
    touched : (k,) int
        Which of the network's inputs are the loads that the hand supplies.
    asked_by : {"load", "place and load"}
        Whether the network is asked by loads alone, or first by the place along each touched load, m.
    mirror : (3,), optional
        Direction of the one load; given where a load of the other sign bends the body to the mirror image.
    radius : float
        Half the height of the section, m, for drawing.
    of_interest : (k,) int
        Nodes whose displacement the study asks for.
    meta : mapping
        JSON-able record of its training.

    Raises
    ------
    UsageError
        If the parts do not fit together.
    """

    carrier: ClassVar[Literal["line"]] = "line"
    asked_as_body: ClassVar[bool] = False

    name: str
    unit: str
    network: Network
    columns: Annotated[np.ndarray, np.int64]
    points: np.ndarray
    held: int
    touched: Annotated[np.ndarray, np.int64] = field(default_factory=lambda: np.zeros(1, np.int64))
    asked_by: AskedBy = "load"
    mirror: np.ndarray | None = None
    radius: float = 0.005
    of_interest: Annotated[np.ndarray, np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    meta: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        own_arrays(self, "points", "mirror")
        own_arrays(self, "columns", "touched", "of_interest", dtype=np.int64)
        nodes, m, n = len(self.points), len(self.network.outputs), len(self.network.inputs)
        whole = self.columns.shape == (m, 2) and self.points.shape == (nodes, 3)
        fits = whole and bool(
            ((self.columns >= 0) & (self.columns < [nodes, 3])).all()
            and 0 <= self.held < nodes
            and len(self.touched)
            and ((self.touched >= 0) & (self.touched < n)).all()
            and ((self.of_interest >= 0) & (self.of_interest < nodes)).all()
            and np.isfinite(self.points).all()
            and (self.mirror is None or (self.mirror.shape == (3,) and n == 1))
        )
        if not (fits and math.isfinite(self.radius)):
            raise UsageError(
                f"A field at nodes can't be made of {m} outputs and points {self.points.shape}.",
                why="Its network, columns, nodes and held node do not fit together.",
                fix="Let `palpate.learn` make it of one set of solves.",
            )

    def __str__(self) -> str:
        inputs = ", ".join(str(r) for r in self.inputs)
        return (
            f"field {self.name} at {len(self.points)} nodes by {inputs}; {count(self.network.units, 'unit')}"
        )

    @property
    def further(self) -> tuple[int, ...]:
        """Which of the inputs are loads that the hand does not supply."""
        first = len(self.touched) if self.asked_by == "place and load" else 0
        return tuple(i for i in range(first, len(self.inputs)) if i not in self.touched)

    def fault_beside(self, energy: LearntEnergy) -> str:
        """Return what does not fit the energy of the same body; "" if all does."""
        felt, further = len(energy.baseline.directions), len(energy.parameters)
        if len(self.touched) != felt:
            return f"it has {len(self.touched)} loads that a hand supplies, not {felt}"
        wanted = felt + further + (felt if self.asked_by == "place and load" else 0)
        return "" if len(self.inputs) == wanted else f"it has {len(self.inputs)} inputs, not {wanted}"

    def values(self, X: np.ndarray) -> np.ndarray:
        """Return the field (N, nodes, 3) at inputs X (N, n).

        Raises
        ------
        UsageError
            If X has another number of columns.
        """
        X = np.atleast_2d(np.asarray(X, dtype=float))
        other = X[:, 0] < 0.0 if self.mirror is not None else np.zeros(len(X), dtype=bool)
        asked = np.where(other[:, None], -X, X) if self.mirror is not None else X
        full = np.zeros((len(X), len(self.points), 3))
        full[:, self.columns[:, 0], self.columns[:, 1]] = self.network.predict(
            np.clip(asked, *bounds(self.inputs))
        )
        if self.mirror is not None:
            D = self.mirror
            full[other] -= 2.0 * (full[other] @ D)[..., None] * D
        return full

    def node(self, directions: np.ndarray) -> NodeEvaluator:
        """Return the allocation-free evaluator of the held node's value.

        Parameters
        ----------
        directions : (k, 3)
            Unit directions of the touched loads.
        """
        return NodeEvaluator(self, directions)


register_kind(Field, NodeField, "NodeField")


class NodeEvaluator:
    """Evaluates the held node's value; nothing is allocated.

    Attributes
    ----------
    value : (3,)
        Value where the last call evaluated.
    inputs : (n,)
        The field's inputs there, as `NodeField.values` takes them.

    Parameters
    ----------
    whole : NodeField
        The field of all nodes.
    directions : (k, 3)
        Unit directions of the touched loads.
    """

    def __init__(self, whole: NodeField, directions: np.ndarray) -> None:
        own = [i for i, node in enumerate(whole.columns[:, 0]) if node == whole.held]
        self.value, self.inputs = np.zeros(3), np.zeros(len(whole.inputs))
        low, high = bounds(whole.inputs)
        mirror = np.zeros(3) if whole.mirror is None else whole.mirror
        self._asked = (
            np.ascontiguousarray(directions, dtype=np.float64),
            whole.touched,
            np.array(whole.further, dtype=np.int64),
            whole.asked_by == "place and load",
        )
        self._limits = (low, high, np.ascontiguousarray(mirror, dtype=np.float64), whole.mirror is not None)
        self._answer = (np.zeros(len(whole.inputs)), np.zeros(len(own)), whole.columns[own, 1].copy())
        # a node that no output tells of stays where it is: the net of another one is asked, and nothing is taken of it
        self._net = whole.network.select(own or [0]).compiled()
        if not own:
            self._answer = (self._answer[0], np.zeros(1), np.full(1, -1, dtype=np.int64))
        self(np.zeros(3), np.zeros(3), np.zeros(len(whole.further)))  # compile now, not in the loop

    def __call__(self, position: np.ndarray, force: np.ndarray, parameters: np.ndarray) -> None:
        """Renew the attributes.

        Parameters
        ----------
        position : (3,)
            The hand's displacement from rest, m.
        force : (3,)
            On the hand, N; the loads are what it pulls with.
        parameters : (p,)
            The loads that the hand does not supply, N.
        """
        _ask(position, force, parameters, self.inputs, *self._asked)
        _node_into(self.inputs, self.value, *self._limits, *self._answer, *self._net)


@kernel
def _ask(position, force, parameters, inputs, directions, touched, further, by_place) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Fill the field's inputs: what the hand pulls with, the loads elsewhere, and its place where that is asked."""
    for a in range(touched.size):
        pull, place = 0.0, 0.0
        for i in range(3):
            pull -= directions[a, i] * force[i]
            place += directions[a, i] * position[i]
        inputs[touched[a]] = pull
        if by_place:
            inputs[a] = place
    for b in range(further.size):
        inputs[further[b]] = parameters[b]


@kernel
def _node_into(inputs, value, low, high, mirror, mirrors, x, y, components, *net) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN002
    """Fill the held node's value at inputs (n,), those beyond the trained ranges at their edge."""
    other = mirrors and inputs[0] < 0.0
    for i in range(x.size):
        asked = -inputs[i] if other else inputs[i]
        x[i] = asked if math.isnan(asked) else min(max(asked, low[i]), high[i])
    value[:] = 0.0
    point_into(x, y, *net)
    for i in range(components.size):
        if components[i] >= 0:
            value[components[i]] = y[i]
    if other:
        along = 2.0 * (mirror[0] * value[0] + mirror[1] * value[1] + mirror[2] * value[2])
        for i in range(3):
            value[i] -= along * mirror[i]
