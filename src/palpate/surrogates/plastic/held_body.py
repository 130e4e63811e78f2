"""A body held at one node that remembers: bent and stays bent, or pushed and creeps.

The hand moves the held node by w along the direction D of the load it supplies, w = D·position. Two things are learnt:

    stretch   ℓ(w), a network: h = w exp ℓ(w) is the coordinate in which the elastic energy is ½ K h²
    elements  springs in parallel that slip or relax, of the stiffness K together (`elements`)

    F = −Σ k_i e_i h'(w) D

so that without memory F = −∂U/∂w with U = ½ K h². Where both sides answer alike ℓ is a function of w². Beyond the
trained range h goes on along its tangent: the force stays a gradient at kept memory and `inside` says so.

What is shown, the displacement of every node, is another network, over (w, P): bending that stays is shaped
otherwise than bending that springs back, and w and P tell how much there is of each.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from palpate.network import Network
from palpate.surrogates.memories.iwan_elements import IwanElements
from palpate.surrogates.plastic.held_evaluator import HeldEvaluator
from palpate.units import Range, bounds

__all__ = ["HeldBody"]


@dataclass(frozen=True, eq=False, repr=False)
class HeldBody:
    """A body held at one node that remembers what was done to it.

    Attributes
    ----------
    name : str
    stretch : Network
        w in m, or w² in m² where both sides answer alike → ℓ, a pure number.
    shape : Network
        w in m and P in N → displacement in m of every mesh node, x and y in turn.
    elements : IwanElements
    mirrors : bool
        Whether both sides answer alike.
    rest : (node, 3)
        Mesh nodes at rest, m.
    nodes_of_interest : (k,) int
    touch_node : int
        The node that the hand holds.
    directions : (1, 3)
        Unit direction D of the load.
    reach : float
        Largest trained |w|, m.
    radius : float
        Half the height of the section, m, for the picture.
    meta : mapping
        Training record.
    """

    name: str
    stretch: Network
    shape: Network
    elements: IwanElements
    mirrors: bool
    rest: np.ndarray
    nodes_of_interest: np.ndarray
    touch_node: int
    directions: np.ndarray
    reach: float
    radius: float = 0.005
    meta: Mapping[str, Any] = field(default_factory=dict)

    def __repr__(self) -> str:
        return str(self)

    def __str__(self) -> str:
        return (
            f"HeldBody {self.name!r}: held at node {self.touch_node}, to {self.reach:.4g} m; {self.elements}; "
            f"stiffness to {self.stiffness_max:.4g} N/m"
        )

    @property
    def inputs(self) -> tuple[Range, ...]:
        """Of the displacement field: where the held node is, and what holds it there."""
        return self.shape.inputs

    @property
    def parameters(self) -> tuple[Range, ...]:
        """Inputs that the hand doesn't supply: none."""
        return ()

    @property
    def stiffness_max(self) -> float:
        """Largest ∂²V/∂w² in N/m over the trained range of the virgin body, for the stability of the loop.

        Sliders and dashpots can only be softer at the same place; V's second term, Σ k_i e_i h″, is that of the elastic
        body at most.
        """
        w = np.linspace(-self.reach, self.reach, 401)
        h, slope = self.stretches(w)
        curve = np.gradient(slope, w)
        return float(self.elements.total * np.max(slope**2 + np.maximum(h * curve, 0.0)))

    def stretches(self, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """h in m and dh/dw at displacements w (N,) in m."""
        evaluator = self.evaluator()
        answers = [evaluator.stretch_at(float(x)) for x in np.asarray(w, dtype=float)]
        h, slope = np.transpose(answers) if answers else np.zeros((2, 0))
        return h, slope

    def displacement(self, loads: np.ndarray, *, mirrored: bool = False) -> np.ndarray:
        """Displacement (N, 3) of every mesh node in m, for `loads` of the evaluator: w in m and P in N.

        Beyond the trained range it is that at its edge. `mirrored` has no meaning here: both sides are learnt.
        """
        del mirrored
        held = np.clip(np.atleast_2d(loads), *bounds(self.inputs))
        full = np.zeros_like(self.rest)
        full[:, :2] = self.shape.predict(held).reshape(len(self.rest), 2)
        return full

    def evaluator(self, *, period: float = 1e-3) -> HeldEvaluator:
        """The allocation-free evaluator of the 1 kHz path, of a virgin body; a call of it takes `period` seconds."""
        return HeldEvaluator(self, period=period)

    def follow(
        self, w: np.ndarray, times: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Along a history of displacements from the virgin body.

        Parameters
        ----------
        w : (N,)
            Displacements of the held node in m.
        times : (N,), optional
            In s, ascending from 0; bodies that relax need them.

        Returns
        -------
        force : (N,)
            P = −F·D in N: what holds it there.
        stored, lost : (N,)
            Energy in J.
        """
        times = np.zeros(len(w)) if times is None else np.asarray(times, dtype=float)
        evaluator, position = self.evaluator(), np.zeros(3)
        out = np.zeros((3, len(w)))
        for i, (x, dt) in enumerate(zip(w, np.diff(times, prepend=0.0), strict=True)):
            position[:] = x * self.directions[0]
            evaluator.step(position, dt)
            out[:, i] = evaluator.loads[1], evaluator.stored, evaluator.lost
        return out[0], out[1], out[2]

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the body to one file.

        Raises
        ------
        UsageError
            If the file can't be written.
        """
        from palpate.surrogates.plastic.held_file import save_held

        return save_held(path, self)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> HeldBody:
        """Read a body back.

        Raises
        ------
        FileFormatError
            If the file is missing, corrupt, foreign or from a later version.
        """
        from palpate.surrogates.plastic.held_file import load_held

        return load_held(path)

    def checked(self) -> HeldBody:
        """Itself, if its parts fit together.

        Raises
        ------
        ValueError
            If they don't.
        """
        nodes = len(self.rest)
        consistent = (
            self.rest.shape == (nodes, 3)
            and bool(np.isfinite(self.rest).all())
            and self.directions.shape == (1, 3)
            and bool(abs(np.linalg.norm(self.directions) - 1.0) < 1e-9)
            and 0 <= self.touch_node < nodes
            and math.isfinite(self.reach)
            and self.reach > 0
            and math.isfinite(self.radius)
            and len(self.stretch.inputs) == len(self.stretch.outputs) == 1
            and len(self.shape.inputs) == 2
            and len(self.shape.outputs) == 2 * nodes
            and bool(((self.nodes_of_interest >= 0) & (self.nodes_of_interest < nodes)).all())
        )
        if not consistent:
            raise ValueError("its networks, nodes and direction do not fit together")
        return self
