"""A body that a hand can hold at one node: drag in, force, loads and deformed shape out.

Three networks learnt from the same solves stand behind it:

    nodes   loads → the displacements that the study asked for (the founding study's five free nodes)
    field   loads → displacement of every mesh node, for the eye
    force   what the hand does → the loads that the hand must supply, for the fingertip

The hand gives the displacement of the held node. Along the loads' directions D_i (unit vectors, i = 1 … k
loads at the held node) its coordinate is h_i = D_i · p; the force network answers with the loads P_i(h),
and the hand feels the reaction F = −Σ P_i D_i.

*One load.* The held node can only move on a curve, so the drag is projected onto it by its component
along the load: for a beam, by vertical deflection. A load range that starts at zero is mirrored about the
beam's axis for the other sign.

*Two loads.* A slender beam is hundreds of thousands of times stiffer along its axis than across it, so
near the straight state all axial loads share one displacement and displacement → force is not a function.
A virtual coupling of stiffness k_c between hand and node makes it one (Colgate, Stanley & Brown 1995):
with h = D·u(P) + P/k_c the map h → P has a Jacobian between 0 and k_c, and P = ∇E(h) of the energy E = W
+ |P|²/2k_c, W being the strain energy. `contact` is then the node's own position, apart from the hand's.

Outside the trained range the inputs are taken at the nearest edge and the loads are held at their trained
limits: force stays bounded and continuous, and `inside` says so.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit

from palpate.errors import FileFormatError, UsageError
from palpate.network import Archive, Network, load_archive, save_archive
from palpate.network.network_kernels import value_into
from palpate.units import Range, bounds

__all__ = ["TouchEvaluator", "TouchModel"]

KIND = "touch"
OUTSIDE, MIRRORED = 1, 2  # flags of one evaluation
_NONE = np.zeros(0)
SLACK = 1e-3  # of a load's range: more than a network's error at the edge, less than a hand can tell


@dataclass(frozen=True, eq=False)
class TouchModel:
    """Networks and geometry of a body held at one node. A value: `save` and `load` give it back bit for bit.

    Attributes
    ----------
    name : str
    networks : mapping
        ``nodes``, ``field`` and ``force``; see the module's docstring.
    rest : (N, 3)
        Rest positions of the mesh nodes, m.
    nodes_of_interest : (q,) int
    touch_node : int
        The node that the hand holds.
    touched : tuple of int
        Which of the loads the hand supplies; the others are parameters.
    directions : (k, 3)
        Unit vectors of the touched loads.
    compliance : float
        1/k_c of the virtual coupling, m/N; 0 without one.
    mirrors : bool
        Whether drags against the load's direction are answered by symmetry.
    reach : float
        Largest displacement of the held node in the training data, m.
    stiffness_max : float
        Largest eigenvalue of ∂P/∂h over the trained range, N/m: what the loop's stability depends on.
    radius : float
        Half the beam's depth, for drawing, m.
    meta : mapping
        Settings, errors, provenance (JSON-able).
    """

    name: str
    networks: Mapping[str, Network]
    rest: np.ndarray
    nodes_of_interest: np.ndarray
    touch_node: int
    touched: tuple[int, ...]
    directions: np.ndarray
    compliance: float
    mirrors: bool
    reach: float
    stiffness_max: float
    radius: float
    meta: Mapping[str, Any] = field(default_factory=dict)

    def __str__(self) -> str:
        loads = ", ".join(str(r) for r in self.inputs)
        units = ", ".join(f"{k} {v.units}" for k, v in self.networks.items())
        return f"TouchModel {self.name}: {loads}; units: {units}; reach {self.reach:.3g} m"

    @property
    def inputs(self) -> tuple[Range, ...]:
        """Names and trained ranges of all loads, N."""
        return self.networks["field"].inputs

    @property
    def parameters(self) -> tuple[Range, ...]:
        """The loads that the hand does not supply."""
        return tuple(r for i, r in enumerate(self.inputs) if i not in self.touched)

    def displacement(self, loads: np.ndarray, *, mirrored: bool = False) -> np.ndarray:
        """Displacement (N, 3) of every mesh node under loads (n,), m.

        Loads beyond their trained range are held at its end: the network knows nothing further out.
        """
        held = np.clip(np.atleast_2d(loads), *bounds(self.inputs))
        planar = self.networks["field"].predict(held).reshape(len(self.rest), 2)
        full = np.zeros_like(self.rest)
        full[:, :2] = planar
        return _reflect(full, self.directions[0]) if mirrored else full

    def evaluator(self) -> TouchEvaluator:
        """The allocation-free evaluator of the 1 kHz path."""
        return TouchEvaluator(self)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the model to one file.

        Raises
        ------
        UsageError
            If the file can't be written.
        """
        arrays = {
            "rest": self.rest,
            "directions": self.directions,
            "nodes_of_interest": self.nodes_of_interest,
        }
        plain = ("name", "touch_node", "compliance", "mirrors", "reach", "stiffness_max", "radius")
        meta: dict[str, Any] = {k: getattr(self, k) for k in plain}
        meta |= {"touched": list(self.touched), "meta": dict(self.meta)}
        return save_archive(path, Archive(self.networks, arrays, meta, KIND))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> TouchModel:
        """Read a model back.

        Raises
        ------
        FileFormatError
            If the file is missing, corrupt, foreign or from a later version.
        """
        archive = load_archive(path, kind=KIND)
        try:
            return cls(
                networks=archive.networks,
                rest=archive.arrays["rest"],
                nodes_of_interest=archive.arrays["nodes_of_interest"],
                directions=archive.arrays["directions"],
                **(dict(archive.meta) | {"touched": tuple(archive.meta["touched"])}),
            )._checked()
        except (KeyError, TypeError, ValueError, IndexError) as error:
            raise FileFormatError(f"{path} does not describe a touch model.", why=str(error)) from error

    def _checked(self) -> TouchModel:
        n, k, nodes = len(self.inputs), len(self.touched), len(self.rest)
        consistent = (
            self.rest.shape == (nodes, 3)
            and self.directions.shape == (k, 3)
            and 0 <= self.touch_node < nodes
            and all(0 <= i < n for i in self.touched)
            and len(self.networks["field"].outputs) == 2 * nodes
            and len(self.networks["force"].outputs) == k
            and len(self.networks["force"].inputs) == n
            and bool(np.isfinite(self.rest).all())
        )
        if not consistent:
            raise ValueError("its networks, nodes and loads do not fit together")
        return self


def _reflect(vectors: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Mirror vectors (…, 3) in the plane normal to a unit direction (3,)."""
    return np.asarray(vectors - 2.0 * (vectors @ direction)[..., None] * direction)


class TouchEvaluator:
    """Hand position in, force out; nothing is allocated per call.

    Attributes
    ----------
    force : (3,)
        Force on the hand, N.
    contact : (3,)
        Where the held node is, as an offset from its rest position, m.
    loads : (n,)
        The loads that hold the body there, N: input of `TouchModel.displacement`.
    inside : bool
        Whether the hand is inside the trained range.
    mirrored : bool
        Whether the answer was mirrored about the beam's axis.
    """

    def __init__(self, model: TouchModel) -> None:
        n, k = len(model.inputs), len(model.touched)
        low, high = bounds(model.inputs)
        h_low, h_high = bounds(model.networks["force"].inputs)
        others = [i for i in range(n) if i not in model.touched]
        self.force, self.contact, self.loads = np.zeros(3), np.zeros(3), np.zeros(n)
        self.inside, self.mirrored = True, False
        self._shape = (len(others),)
        self._maps = (
            np.array(model.touched),
            np.array(others, dtype=np.int64),
            model.directions.astype(np.float64),
        )
        self._limits = (low, high, h_low, h_high)
        self._laws = (float(model.compliance), bool(model.mirrors), 0.01 * model.reach)
        self._work = (np.zeros(n), np.zeros(k), np.zeros(2))
        held = slice(2 * model.touch_node, 2 * model.touch_node + 2)
        self._force_net = model.networks["force"].compiled()
        self._tip_net = model.networks["field"].select(held).compiled()
        self(np.zeros(3), np.array([r.low for r in model.parameters]))  # compile now, not in the loop

    def __repr__(self) -> str:
        where = "inside" if self.inside else "outside"
        return f"TouchEvaluator: force {self.force} N, contact {self.contact} m, {where} the trained range"

    def __call__(self, position: np.ndarray, parameters: np.ndarray = _NONE) -> None:
        """Evaluate at a hand position; float64 arrays are taken as they are, other sequences are converted.

        Parameters
        ----------
        position : (3,) float64
            Offset of the hand from the held node's rest position, m.
        parameters : (p,) float64
            Loads that the hand does not supply, N; none for a body whose only loads are at the held node.

        Raises
        ------
        UsageError
            If there are not three coordinates and p parameters.
        """
        position, parameters = np.asarray(position, np.float64), np.asarray(parameters, np.float64)
        if position.shape != (3,) or parameters.shape != self._shape:
            raise UsageError(
                f"A hand at {position.shape} with parameters {parameters.shape} can't be answered.",
                fix=f"Give a position (3,) in m and parameters {self._shape} in N.",
            )
        flags = _touch(
            position,
            parameters,
            self.force,
            self.contact,
            self.loads,
            self._maps,
            self._limits,
            self._laws,
            self._work,
            self._force_net,
            self._tip_net,
        )
        self.inside, self.mirrored = (flags & OUTSIDE) == 0, (flags & MIRRORED) != 0


_jit = njit(cache=True, nogil=True, error_model="numpy")


@_jit
def _clip(value: float, low: float, high: float) -> float:
    """The nearest value in [low, high]; not-a-number stays visible to the loop."""
    if math.isnan(value):
        return value
    return min(max(value, low), high)


@_jit
def _dot(directions: np.ndarray, a: int, p: np.ndarray) -> float:
    return float(directions[a, 0] * p[0] + directions[a, 1] * p[1] + directions[a, 2] * p[2])


@_jit
def _hand_inputs(position, parameters, loads, maps, limits, mirrors, hand) -> int:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Fill the force network's inputs: touched coordinates first, then the parameters."""
    touched, others, directions = maps
    low, high, h_low, h_high = limits
    flags = 0
    for a in range(touched.size):
        h = _dot(directions, a, position)
        if mirrors and h < 0.0:
            h, flags = -h, flags | MIRRORED
        hand[a] = _clip(h, h_low[a], h_high[a])
        # one part in 10⁹ of the range is round-off at its edge
        if abs(hand[a] - h) > 1e-9 * (h_high[a] - h_low[a]):
            flags |= OUTSIDE
    for b in range(others.size):
        i = others[b]
        loads[i] = _clip(parameters[b], low[i], high[i])
        hand[touched.size + b] = loads[i]
        if loads[i] != parameters[b]:
            flags |= OUTSIDE
    return flags


@_jit
def _answer(force, contact, loads, maps, tip, mirrored) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Reaction on the hand and position of the held node, in the hand's own half of the plane."""
    touched, _, directions = maps
    sign = -1.0 if mirrored else 1.0
    force[:] = 0.0
    contact[0], contact[1], contact[2] = tip[0], tip[1], 0.0
    for a in range(touched.size):
        for j in range(3):
            force[j] -= sign * loads[touched[a]] * directions[a, j]
    if mirrored:
        along = _dot(directions, 0, contact)
        for j in range(3):
            contact[j] -= 2.0 * along * directions[0, j]


@_jit
def _touch(position, parameters, force, contact, loads, maps, limits, laws, work, force_net, tip_net) -> int:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """One evaluation; returns the flags."""
    touched, _, directions = maps
    low, high, _, _ = limits
    compliance, mirrors, slack = laws
    hand, pull, tip = work
    flags = _hand_inputs(position, parameters, loads, maps, limits, mirrors, hand)
    value_into(hand, pull, *force_net)
    for a in range(touched.size):
        i = touched[a]
        loads[i] = _clip(pull[a], low[i], high[i])
        # where a load beyond its trained range would be needed, the hand is where no trained state is
        if abs(loads[i] - pull[a]) > SLACK * (high[i] - low[i]):
            flags |= OUTSIDE
    value_into(loads, tip, *tip_net)
    _answer(force, contact, loads, maps, tip, (flags & MIRRORED) != 0)
    if compliance > 0.0:
        # the answer must lead back to the hand: where it does not, no trained state has the hand there
        for a in range(touched.size):
            back = _dot(directions, a, contact) + compliance * loads[touched[a]]
            if abs(back - hand[a]) > slack:
                flags |= OUTSIDE
    return flags
