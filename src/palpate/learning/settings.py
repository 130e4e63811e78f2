"""The filter's settings, and two named sets of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from palpate.errors import UsageError

__all__ = ["Settings", "default", "founding"]

Tail = Literal["affine", "constant", "none"]
Widths = Literal["log", "plain"]

_POSITIVE = (
    *("window", "distance_max", "distance_min", "overlap", "prior", "width_prior", "tail_prior"),
    *("distance_decay", "noise", "edge_weight", "iterations"),
)
_NOT_NEGATIVE = (
    *("error_min", "error_rms_min", "process_noise", "noise_share", "gate", "step_bound", "forgetting"),
    *("prune_below", "prune_after", "units_max"),
)


@dataclass(frozen=True)
class Settings:
    """Everything the sequential filter is told; inputs in [−1, 1], outputs scaled to about 1 (see `Scaling`).

    Attributes
    ----------
    tail : {"affine", "constant", "none"}
        What is added to the units: T·[1, x], T, or nothing.
    widths : {"log", "plain"}
        Whether the filter's states are log σ, so that no step can make a width negative, or σ itself.
    error_min, error_rms_min : float
        e_min and e'_min: growth needs an error norm above the first and a windowed RMS error above the second.
    window : int
        M, the observations in that RMS.
    wait_for_window : bool
        Whether growth waits until the window is full; if not, the RMS divides by what is there.
    distance_max, distance_min, distance_decay : float
        ε_max, ε_min, γ: growth needs a distance to the nearest centre above max(ε_max γᵗ, ε_min).
    overlap : float
        κ: a new unit's width is κ times its distance to the nearest centre.
    prior, width_prior, tail_prior : float
        Prior variances of a new unit's weights and centre, of its widths, and of the tail.
    process_noise : float
        q₀, added to every variance after each update.
    noise : float
        R, the smallest measurement variance of one scaled output.
    noise_share, gate : float
        The measurement variance is at least these shares of the running mean square of the innovation and of
        this innovation's own mean square. Finite-element data have no noise, but the linearised filter has
        its own error: an R far below the innovation makes it diverge in every covariance form.
    edge_weight : float
        Smallest factor on R at the ends of the input range (see `noise.edge_factor`); 1 turns this off.
    iterations : int
        Linearisations per update; 1 is the plain extended filter.
    step_bound : float
        Largest change of a centre (in widths) and of a log width in one update; 0 for none.
    forgetting : float
        Largest factor by which one update, or the removal of a unit, may raise the squared error over the
        window; 0 for no limit.
    update_on_growth : bool
        Whether an observation that added a unit also updates everything.
    prune_below : float
        δ: a unit is silent while its normalised contribution stays below this in every output.
    prune_after : int
        S_w: silent observations in a row after which a unit is removed; 0 for never.
    units_max : int
        Growth stops here.

    Raises
    ------
    UsageError
        If a number is out of its range.
    """

    tail: Tail = "affine"
    widths: Widths = "log"
    error_min: float = 1e-2
    error_rms_min: float = 1e-2
    window: int = 50
    wait_for_window: bool = False
    distance_max: float = 1.0
    distance_min: float = 0.3
    distance_decay: float = 0.98
    overlap: float = 0.87
    prior: float = 1.0
    width_prior: float = 1.0
    tail_prior: float = 1.0
    process_noise: float = 0.0
    noise: float = 1e-8
    noise_share: float = 1.0
    gate: float = 1.0
    edge_weight: float = 0.005
    iterations: int = 5
    step_bound: float = 0.1
    forgetting: float = 1.1
    update_on_growth: bool = True
    prune_below: float = 1e-4
    prune_after: int = 500
    units_max: int = 40

    def __post_init__(self) -> None:
        for name in (*_POSITIVE, *_NOT_NEGATIVE):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, (int, float, np.number)):
                raise UsageError(f"The filter's {name} is {value!r}; it must be a number.")
            if not (value > 0 if name in _POSITIVE else value >= 0):
                rule = "be positive" if name in _POSITIVE else "not be negative"
                raise UsageError(f"The filter's {name} is {value}; it must {rule}.")
        if not 0 < self.distance_decay <= 1:
            raise UsageError(f"The filter's distance_decay is {self.distance_decay}; it must lie in (0, 1].")
        for name, known in (("tail", get_args(Tail)), ("widths", get_args(Widths))):
            if getattr(self, name) not in known:
                raise UsageError(
                    f"The filter's {name} is {getattr(self, name)!r}; it is one of {', '.join(known)}."
                )


def default() -> Settings:
    """Affine tail, log widths, guarded noise, iterated and bounded steps: stable on noise-free data."""
    return Settings()


def founding() -> Settings:
    """The form of the papers: plain widths, no tail, one linearisation, fixed R, growth once the window is full.

    After Lu, Sundararajan & Saratchandran 1997 and Narayanan, Singla, Garimella, Waz & Krovi 2011, who tuned
    thresholds by hand for each beam; these are for inputs in [−1, 1] and outputs scaled to 1. The finite-element
    papers write exp(−½ …), so their κ = 0.87 is 1.2 here.
    """
    return Settings(
        tail="none",
        widths="plain",
        error_min=5e-3,
        error_rms_min=5e-3,
        overlap=1.2,
        wait_for_window=True,
        distance_min=0.2,
        window=25,
        forgetting=0.0,
        noise=1e-3,
        noise_share=0.0,
        gate=0.0,
        edge_weight=1.0,
        iterations=1,
        step_bound=0.0,
        prune_below=1e-3,
        prune_after=50,
    )
