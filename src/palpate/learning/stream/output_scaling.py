"""Scaling of a stream: from a sensor's quantities to those that the filter learns, scaled outputs or their modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from palpate.network import Network, Scaling
from palpate.rbf.filter.observation import Observation
from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State, initial
from palpate.rbf.freezing import freeze
from palpate.rbf.output_modes import output_modes
from palpate.rbf.regressors import pairs
from palpate.units import Quantity, Range, bounds

__all__ = ["OutputScaling", "declared_scaling", "settled_scaling", "spikes"]

_ORDINARY = 0.94  # share of the readings that are no spikes
_SPIKE = 5.0  # times the distance of all of these


@dataclass(frozen=True, eq=False)
class OutputScaling:
    """A scaling, and output modes to learn in."""

    scaling: Scaling  # centres and scales of inputs and outputs
    # (m, r), orthonormal; the filter's outputs are the scaled ones along them
    directions: np.ndarray | None = None

    @property
    def size(self) -> tuple[int, int]:
        """Inputs, and outputs or modes, that the filter learns."""
        outputs = self.scaling.output_scale.size if self.directions is None else self.directions.shape[1]
        return self.scaling.input_half.size, outputs

    def scale(self, observation: Observation) -> Observation:
        """An observation in SI units, in the filter's quantities."""
        s, V = self.scaling, self.directions
        y = s.scale_outputs(observation.y)
        slopes = (
            None
            if observation.slopes is None
            else observation.slopes * s.input_half / s.output_scale[:, None]
        )
        curvatures, (i, j) = observation.curvatures, pairs(observation.x.size)
        if curvatures is not None:
            curvatures = curvatures * (s.input_half[i] * s.input_half[j]) / s.output_scale[:, None]
        if V is not None:
            y, slopes, curvatures = y @ V, _along(V, slopes), _along(V, curvatures)
        return replace(
            observation, x=s.scale_inputs(observation.x), y=y, slopes=slopes, curvatures=curvatures
        )

    def initial_state(self, settings: Settings, Y: np.ndarray | None) -> State:
        """The state to begin with; early outputs Y (N, m) in SI units decide the shared-weight rule's modes."""
        n, m = self.scaling.input_half.size, self.scaling.output_scale.size
        modes = None
        if self.directions is not None:
            m = self.directions.shape[1]  # in order of size already
            modes = np.eye(m)[:, : settings.modes] if settings.modes < m else None
        elif Y is not None:
            modes = output_modes(self.scaling.scale_outputs(Y), settings.modes)
        return initial(n, m, settings, modes if settings.update == "shared" else None)

    def freeze(
        self, state: State, settings: Settings, inputs: tuple[Range, ...], outputs: tuple[Quantity, ...]
    ) -> Network:
        """The state as a network value in SI units."""
        meta = {"training": {"samples": state.count}}
        return freeze(state, settings, inputs, outputs, self.scaling, basis=self.directions, meta=meta)


def declared_scaling(inputs: Sequence[Range], outputs: Sequence[Quantity | Range]) -> Scaling | None:
    """The scaling that ranges of all outputs declare, their middles and half of the widest; None without them."""
    ranges = [o for o in outputs if isinstance(o, Range)]
    if len(ranges) < len(outputs):
        return None
    low, high = bounds(ranges)
    return Scaling.of(inputs, (low + high)[None] / 2, scale=float((high - low).max() / 2))


def settled_scaling(inputs: Sequence[Range], Y: np.ndarray) -> Scaling:
    """The scaling that the first readings Y (N, m) settle, spikes left aside."""
    return Scaling.of(inputs, Y[~spikes(Y)])


def spikes(Y: np.ndarray) -> np.ndarray:
    """Mask (N,) of readings (N, m) that are much farther from the median than all but a twentieth of them."""
    distance = np.abs(Y - np.median(Y, axis=0)).max(axis=1)
    return np.asarray(distance > _SPIKE * np.quantile(distance, _ORDINARY))


def _along(V: np.ndarray, derivatives: np.ndarray | None) -> np.ndarray | None:
    return None if derivatives is None else V.T @ derivatives
