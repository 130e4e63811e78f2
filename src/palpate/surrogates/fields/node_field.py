"""A field at the nodes of a body that loads bend: for the eye, and for the founding question of loads in, nodes out.

    y(X)      at each node, of the loads X that hold the body there, or of place and load of a rod with a memory

A beam whose one load acts across it and begins at zero is learnt for one sign of the load; the other side is its mirror
image. Beyond the trained ranges the field is that at their edge: the network knows nothing farther out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np

from palpate.checks import own_arrays
from palpate.errors import UsageError
from palpate.network import Network
from palpate.network.network_kernels import value_into
from palpate.units import Range, bounds

if TYPE_CHECKING:
    from palpate.surrogates.energy import LearntEnergy

__all__ = ["NodeEvaluator", "NodeField"]

AskedBy = Literal["load", "place and load"]


@dataclass(frozen=True, eq=False)
class NodeField:
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

    def __repr__(self) -> str:
        return str(self)

    def __str__(self) -> str:
        inputs = ", ".join(str(r) for r in self.inputs)
        return f"{self.name} at {len(self.points)} nodes by {inputs}; {self.network.units} units"

    @property
    def further(self) -> tuple[int, ...]:
        """Which of the inputs are loads that the hand does not supply."""
        first = len(self.touched) if self.asked_by == "place and load" else 0
        return tuple(i for i in range(first, len(self.inputs)) if i not in self.touched)

    @property
    def inputs(self) -> tuple[Range, ...]:
        """Names and trained ranges of the network's inputs."""
        return self.network.inputs

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
        self._components = [int(c) for c in whole.columns[own, 1]]
        self._net = whole.network.select(own).compiled() if own else None
        self._low, self._high = (part.tolist() for part in bounds(whole.inputs))
        self._mirror = None if whole.mirror is None else whole.mirror.tolist()
        self._directions = directions.tolist()
        self._touched, self._further = whole.touched.tolist(), whole.further
        self._by_place = whole.asked_by == "place and load"
        self._x, self._y = np.zeros(len(whole.inputs)), np.zeros(len(own))
        self(np.zeros(3), np.zeros(3), np.zeros(len(self._further)))  # compile now, not in the loop

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
        inputs = self.inputs
        for a, (x, y, z) in enumerate(self._directions):
            inputs[self._touched[a]] = -(x * force[0] + y * force[1] + z * force[2])
            if self._by_place:
                inputs[a] = x * position[0] + y * position[1] + z * position[2]
        for b, i in enumerate(self._further):
            inputs[i] = parameters[b]
        self._evaluate()

    def _evaluate(self) -> None:
        x, mirrored = self._x, self._mirror is not None and self.inputs[0] < 0.0
        for i in range(x.size):
            asked = -self.inputs[i] if mirrored else self.inputs[i]
            x[i] = min(max(asked, self._low[i]), self._high[i])
        self.value[:] = 0.0
        if self._net is None:
            return
        value_into(x, self._y, *self._net)
        for i, component in enumerate(self._components):
            self.value[component] = self._y[i]
        if mirrored and self._mirror is not None:
            a, b, c = self._mirror
            along = 2.0 * (a * self.value[0] + b * self.value[1] + c * self.value[2])
            self.value[0] -= along * a
            self.value[1] -= along * b
            self.value[2] -= along * c
