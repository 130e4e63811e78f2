"""A body pressed anywhere, as the loop and the page need it: where the hand rests, how deep and stiff it is.

The probe's centre c is the hand's place itself, in the body's coordinates, z up. Nothing of the body's answer is
made here: energy, force and stiffness are the surrogate's, and memory, where its file tells of one (`recorded`), is
`palpate.surrogates.relaxation` or `palpate.surrogates.plastic`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.runtime.pressed_evaluator import PressedEvaluator
from palpate.runtime.recorded import branches_told, dents_told, spacing_told
from palpate.surrogates import FieldSurrogate, TouchedBody, TouchSurrogate
from palpate.surrogates.learnt_energy import corrected_by, warning_of
from palpate.surrogates.plastic import DentMemory, Dents
from palpate.surrogates.relaxation import Branches, Memory, Patches
from palpate.units import Range, bounds

__all__ = ["PressedBody"]

_SAMPLES = 4096  # of the trained ranges, for what is largest there
_SHARE = 0.75  # of the deepest trained depth: how deep a scripted stroke goes
_SLIVER = 1e-3  # of the deepest depth: shallower is no press


@dataclass(frozen=True, eq=False)
class PressedBody:
    """An energy of touch with all that follows from it for a hand.

    Attributes
    ----------
    touch : TouchSurrogate
    fields : mapping of name to FieldSurrogate
        What the eye sees; may be empty.
    name : str
    """

    touch: TouchSurrogate
    fields: Mapping[str, FieldSurrogate] = field(default_factory=dict)
    name: str = "body"

    @classmethod
    def of(cls, body: TouchedBody | TouchSurrogate, name: str = "") -> PressedBody:
        """The same body, ready for a hand; `name` where its own record has none."""
        alone = isinstance(body, TouchSurrogate)
        touch = body if isinstance(body, TouchSurrogate) else body.touch
        known = str(touch.meta.get("name", "")) or name or "body"
        if (touches := corrected_by(touch.meta)) is not None:
            known += f", corrected by {touches} touches" + (
                " with a warning" if warning_of(touch.meta) else ""
            )
        return cls(touch, {} if alone else dict(body.fields), known)  # type: ignore[union-attr]

    def __str__(self) -> str:
        return f"PressedBody {self.name}: {self.touch}"

    __repr__ = __str__

    @property
    def inputs(self) -> tuple[Range, ...]:
        """Names and trained ranges of all inputs: the centre's coordinates (m), then the further ones."""
        return self.touch.inputs

    @property
    def parameters(self) -> tuple[Range, ...]:
        """The inputs that the hand doesn't supply."""
        return self.touch.parameters

    @property
    def meta(self) -> Mapping[str, Any]:
        """What its file says of its making."""
        return self.touch.meta

    @property
    def radius(self) -> float:
        """Of the probe, m; the middle of its range where it is an input."""
        own = self.touch.radius_input
        return self.touch.radius if own is None else (self.inputs[own].low + self.inputs[own].high) / 2.0

    @cached_property
    def presses(self) -> np.ndarray:
        """Inputs (N, n) in contact and inside the trained region: random ones, and those it was trained at.

        Raises
        ------
        UsageError
            If there is none.
        """
        low, high = bounds(self.inputs)
        X = np.random.default_rng(0).uniform(low, high, (_SAMPLES, len(low)))
        X[0] = (low + high) / 2.0
        if self.touch.region is not None:
            scaling = self.touch.network.scaling
            X = np.vstack([X, scaling.input_centre + scaling.input_half * self.touch.region.points])
        depth = self.touch.depth(X)
        kept = X[self.touch.inside(X) & (depth > _SLIVER * max(depth.max(), 0.0)) & (depth > 0.0)]
        if not len(kept):
            raise UsageError(
                "This body can't be pressed.",
                why="No probe within the ranges it was trained on touches it.",
                fix="Learn it from solves in contact.",
            )
        return np.asarray(kept)

    @cached_property
    def stiffness_max(self) -> float:
        """K, the largest eigenvalue of −∂F/∂c over the trained region, N/m: what the loop's stability depends on."""
        return float(np.linalg.eigvalsh(-self.touch.stiffness(self.presses)).max())

    @cached_property
    def force_max(self) -> float:
        """Largest ‖F‖ of the trained region, N."""
        return float(np.linalg.norm(self.touch.force(self.presses), axis=1).max())

    @cached_property
    def deepest(self) -> float:
        """Deepest trained depth, m."""
        assert self.touch.continuation is not None
        known = self.touch.continuation.deepest
        return known if math.isfinite(known) else float(self.touch.depth(self.presses).max())

    @cached_property
    def _foothold(self) -> tuple[np.ndarray, np.ndarray]:
        """First contact in the middle of the touched place, and the outer normal there, each (3,)."""
        X = self.presses
        low, high = bounds(self.inputs)
        # the middle of the ranges where that is a press; on a curved body it may lie too deep
        x = X[np.argmin((((X - (low + high) / 2.0) / (high - low)) ** 2).sum(axis=1))]
        distance, slope, _ = self.touch.surface.at(x[None, :3])
        normal = slope[0] / np.linalg.norm(slope[0])
        return x[:3] + (self.radius - distance[0]) * normal, normal

    @property
    def home(self) -> np.ndarray:
        """Where the device's centre is: the probe's centre (3,), m, at first contact in the middle."""
        return self._foothold[0]

    @property
    def normal(self) -> np.ndarray:
        """Outer normal (3,) of the surface there."""
        return self._foothold[1]

    @property
    def away(self) -> np.ndarray:
        """Where a probe that nobody holds is, m: a radius above `home`, in the air."""
        return self.home + self.radius * self.normal

    @cached_property
    def reach(self) -> float:
        """How far from `home` a trained press can be, m."""
        return float(np.linalg.norm(self.presses[:, :3] - self.home, axis=1).max())

    @cached_property
    def branches(self) -> Branches | None:
        """What of its force relaxes, where its file says so.

        Raises
        ------
        FileFormatError
            If it says so in other words than `recorded` knows.
        """
        return branches_told(self.meta)

    @cached_property
    def dents(self) -> Dents | None:
        """How it yields, where its file says so.

        Raises
        ------
        FileFormatError
            If it says so in other words than `recorded` knows, or that it relaxes too.
        """
        if "yielding" in self.meta and "relaxation" in self.meta:
            raise FileFormatError(
                "The file says that the body yields and that it relaxes.",
                why="A print and branches on one energy are not made to go together.",
                fix="Save it with one of them.",
            )
        places = None if "yielding" not in self.meta else self._places(width=1.0, energy=0.0)
        return dents_told(self.meta, None if places is None else places.points)

    def memory(self) -> Memory | DentMemory | None:
        """A body's memory at rest, or None for one that forgets nothing."""
        if self.dents is not None:
            return self.dents.memory()
        if self.branches is None or not self.branches.terms:
            return None
        if spacing_told(self.meta) is None:
            return Memory(self.branches)
        depth = self.deepest / 2.0  # typical
        X = self.presses
        near = np.argmin(np.abs(self.touch.depth(X) - depth))
        energy = float(self.touch.energy(X[near : near + 1])[0])
        return Memory(self.branches, self._places(Patches.width_at(self.radius, depth), energy))

    def _places(self, width: float, energy: float) -> Patches | None:
        """Places of the memory on the touched surface; None where it travels with the probe."""
        spacing, skin = spacing_told(self.meta), next(iter(self.fields.values()), None)
        if spacing is None or skin is None:
            return None
        corners = skin.triangles
        if skin.dimple is not None:
            corners = corners[skin.touched[corners].all(axis=1)]
        return Patches.over(skin.points, corners, spacing, width=width, energy=energy)

    def evaluator(self) -> PressedEvaluator:
        """The allocation-free evaluator of the 1 kHz path."""
        touch, own = self.touch, self.touch.radius_input
        ends = touch.surface.inner, touch.radius, None if own is None else own - 3
        return PressedEvaluator(touch.evaluator(), self.memory(), self.away, self.normal, *ends)

    def stroke(self, scale: float) -> dict[str, float]:
        """Amplitude (m) and direction, in device coordinates, of a stroke that presses to three quarters of `deepest`.

        Parameters
        ----------
        scale : float
            Metres of body per metre of hand.
        """
        x, y, z = (-self.normal).tolist()
        return {"amplitude": _SHARE * self.deepest / scale, "x": x, "y": z, "z": -y}
