"""Frames of a network that grows: what a sequential learner's units do while it learns, for a page or a terminal.

A `GrowthRecorder` is passed to `palpate.learning.learn(…, watch=recorder)`. It keeps a frame wherever a unit appears or
vanishes, and a few hundred others evenly between.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from palpate.network import Scaling
from palpate.rbf.filter.prediction import value
from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State
from palpate.rbf.filter.step import Event
from palpate.units import Quantity, Range

__all__ = ["Frame", "GrowthRecorder"]

EVEN = 300  # frames beside those in which a unit appears or vanishes
CURVE = 81  # places at which the answer of one input is drawn
SHOWN = 400  # samples drawn at most


@dataclass(frozen=True, eq=False)
class Frame:
    """The network after one observation."""

    observation: int  # its number, counting from one over all passes
    centres: np.ndarray  # (h, n), of the units, SI units
    widths: np.ndarray  # (h, n), along each axis, SI units; NaN where the form has none
    strengths: np.ndarray  # (h,), size of each unit's weights over all outputs, in scaled outputs
    grew: np.ndarray | None  # (n,), place of the unit that appeared, SI units
    vanished: np.ndarray  # (k, n), places of the units that vanished, SI units
    error: float  # on held-out samples over full scale; without these, running mean error of the innovation
    curve: np.ndarray | None = None  # (81,), for one input: the answer in the output that is drawn, SI units

    @property
    def units(self) -> int:
        """Number of units."""
        return len(self.centres)


@dataclass(eq=False)
class GrowthRecorder:
    """Keeper of frames; it is told of every observation by the learner."""

    show: Callable[[GrowthRecorder], None] | None = None  # called with the recorder after every observation
    frames: list[Frame] = field(default_factory=list)
    inputs: tuple[Range, ...] = ()
    outputs: tuple[Quantity, ...] = ()
    # (N, n) and (N, m), SI units
    samples: tuple[np.ndarray, np.ndarray] = (np.empty((0, 0)), np.empty((0, 0)))
    total: int = 0  # observations of the whole run
    errors: list[float] = field(default_factory=list)  # after every observation
    counts: list[int] = field(default_factory=list)  # units after every observation
    heldout: bool = False  # True where errors are those on held-out samples
    latest: Frame | None = None
    _scaling: Scaling | None = None
    _settings: Settings | None = None
    _places: np.ndarray = field(default_factory=lambda: np.empty((0, 0)))
    _centres: np.ndarray = field(default_factory=lambda: np.empty((0, 0)))

    def begin(
        self,
        samples: tuple[np.ndarray, np.ndarray],
        names: tuple[Sequence[Range], Sequence[Quantity]],
        scaling: Scaling,
        settings: Settings,
        total: int,
        *,
        heldout: bool,
    ) -> None:
        """Take what a run is of: samples X (N, n), Y (N, m) in SI units, their names, and the total of observations."""
        self.samples, self.total, self.heldout = samples, total, heldout
        self.inputs, self.outputs = tuple(names[0]), tuple(names[1])
        self._scaling, self._settings = scaling, settings
        self._places = self._centres = np.empty((0, len(self.inputs)))

    @property
    def drawn(self) -> int:
        """Column of the output that is drawn against a single input: the one that varies most."""
        return int(np.argmax(np.ptp(self.samples[1], axis=0))) if self.samples[1].size else 0

    def grid(self) -> np.ndarray:
        """Return the places (81, 1) at which the answer of a single input is drawn."""
        return np.linspace(self.inputs[0].low, self.inputs[0].high, CURVE)[:, None]

    def observe(self, state: State, event: Event, place: np.ndarray, error: float) -> None:
        """Take the state after an observation at a scaled place (n,), what it did, and the error after it."""
        self.errors.append(float(error))
        self.counts.append(state.units)
        number = len(self.errors)
        changed = event.grew or event.pruned > 0
        stride = max(1, self.total // EVEN)
        if changed or number % stride == 0 or number == self.total:
            self.latest = self._frame(number, state, event, place, float(error))
            self.frames.append(self.latest)
        if changed:
            self._places = state.places.copy()
        if self.show is not None:
            self.show(self)

    def _frame(self, number: int, state: State, event: Event, place: np.ndarray, error: float) -> Frame:
        assert self._scaling is not None
        assert self._settings is not None
        scaling, settings = self._scaling, self._settings
        half = scaling.input_half
        centres = state.centres(settings) * half + scaling.input_centre
        widths = state.widths(settings)[:, : len(half)]
        if widths.shape != centres.shape:  # units that have no width along each axis
            widths = np.full(centres.shape, np.nan)
        grew = place * half + scaling.input_centre if event.grew else None
        before, at = self._centres, self._places
        if grew is not None:
            before, at = np.vstack([before, grew]), np.vstack([at, place])
        vanished = before[_vanished(at, state.places)] if event.pruned else before[:0]
        curve = None
        if len(self.inputs) == 1:
            answers = value(state, scaling.scale_inputs(self.grid()), settings)[:, self.drawn]
            curve = answers * scaling.output_scale[self.drawn] + scaling.output_centre[self.drawn]
        self._centres = centres.copy()
        strengths = np.sqrt((state.weights**2).mean(axis=1))
        return Frame(number, centres, widths * half, strengths, grew, vanished, error, curve)

    def describe(self) -> dict[str, Any]:
        """Return what a page needs to play the growth, as plain data with four digits."""
        low = np.array([r.low for r in self.inputs])
        high = np.array([r.high for r in self.inputs])
        X, Y = self.samples
        rows = np.unique(np.linspace(0, max(len(X) - 1, 0), min(SHOWN, len(X))).astype(int))
        every = max(1, len(self.errors) // 1500)
        one = len(self.inputs) == 1
        output = self.outputs[self.drawn]
        return {
            "inputs": [asdict(r) for r in self.inputs],
            "output": {"name": output.name, "unit": output.unit},
            "samples": _digits(X[rows]),
            "values": _digits(Y[rows, self.drawn]),
            "grid": _digits(self.grid()[:, 0]) if one else [],
            "total": self.total,
            "heldout": self.heldout,
            "errors": {
                "at": list(range(1, len(self.errors) + 1, every)),
                "error": _digits(self.errors[::every]),
            },
            "units": self.counts[::every],
            "grown": sum(frame.grew is not None for frame in self.frames),
            "pruned": int(sum(len(frame.vanished) for frame in self.frames)),
            "frames": [_plain(frame, high - low) for frame in self.frames],
        }


def _vanished(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return which units (h,) are gone: units keep their order, and where each was added (h, n)."""
    gone, kept = np.ones(len(before), dtype=bool), 0
    for i, place in enumerate(before):
        if kept < len(after) and np.array_equal(place, after[kept]):
            gone[i] = False
            kept += 1
    return gone


def _plain(frame: Frame, span: np.ndarray) -> dict[str, Any]:
    widths = np.where(np.isfinite(frame.widths), np.clip(frame.widths, 0, 4 * span), 0.1 * span)
    plain: dict[str, Any] = {
        "t": frame.observation,
        "c": _digits(frame.centres),
        "w": _digits(widths),
        "s": _digits(frame.strengths),
        "e": _digits(frame.error),
    }
    if frame.grew is not None:
        plain["g"] = _digits(frame.grew)
    if len(frame.vanished):
        plain["v"] = _digits(frame.vanished)
    if frame.curve is not None:
        plain["y"] = _digits(frame.curve)
    return plain


def _digits(values: Any) -> Any:
    """Return numbers as nested lists of four digits; None where one is not finite."""
    array = np.asarray(values, dtype=float)
    if array.ndim == 0:
        return float(f"{float(array):.4g}") if np.isfinite(array) else None
    return [_digits(row) for row in array]
