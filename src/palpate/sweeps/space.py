"""The space of inputs, made of named ranges with units, and the designs that place samples in it.

A design is a function (space, samples, seed) -> points (N, n). A new one is entered in `DESIGNS` under its name.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from palpate.errors import UsageError
from palpate.format import count
from palpate.units import Range, bounds

__all__ = ["DESIGNS", "Design", "Space", "design_points", "grid", "random", "sobol"]


@dataclass(frozen=True)
class Space:
    """A box of n named ranges.

    Attributes
    ----------
    ranges : tuple of Range
        Name, interval and unit of each input.

    Raises
    ------
    UsageError
        Without ranges, or if two share a name.
    """

    ranges: tuple[Range, ...]

    def __init__(self, ranges: Sequence[Range]) -> None:
        object.__setattr__(self, "ranges", tuple(ranges))
        if not self.ranges or len(set(self.names)) < len(self.names):
            raise UsageError(
                "A space needs at least one range, each with a name of its own.",
                why=f"The names given are: {', '.join(self.names) or 'none'}.",
                fix="Name the ranges apart.",
            )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return tuple(r.name for r in self.ranges)

    @property
    def low(self) -> np.ndarray:
        """Lower ends, shape (n,)."""
        return bounds(self.ranges)[0]

    @property
    def high(self) -> np.ndarray:
        """Upper ends, shape (n,)."""
        return bounds(self.ranges)[1]

    def __len__(self) -> int:
        return len(self.ranges)

    def __iter__(self) -> Iterator[Range]:
        return iter(self.ranges)

    def __getitem__(self, name: str) -> Range:
        for r in self.ranges:
            if r.name == name:
                return r
        raise UsageError(
            f"There is no input called {name!r}.",
            why=f"The inputs are: {', '.join(self.names)}.",
            fix="Choose one of these.",
        )

    def to_unit(self, x: np.ndarray) -> np.ndarray:
        """Map points (..., n) of the space onto [0, 1]."""
        return np.asarray((np.asarray(x, dtype=float) - self.low) / (self.high - self.low))

    def from_unit(self, t: np.ndarray) -> np.ndarray:
        """Map points (..., n) of [0, 1] onto the space; 0 and 1 give its ends exactly."""
        t = np.asarray(t, dtype=float)
        return np.asarray(np.where(t == 1.0, self.high, self.low + t * (self.high - self.low)))

    def points(self, x: object) -> np.ndarray:
        """Check points and shape them as (N, n); a plain list will do for n = 1.

        Raises
        ------
        UsageError
            If they have another shape or are not finite. Points outside the ranges are allowed.
        """
        values = np.asarray(x, dtype=float)
        if values.ndim == 1 and len(self) == 1:
            values = values[:, None]
        if values.ndim != 2 or values.shape[1] != len(self) or not np.isfinite(values).all():
            raise UsageError(
                f"Points of shape {values.shape} can't be taken in this space.",
                why=f"It has {count(len(self), 'input')} ({', '.join(self.names)}), and all values must be finite.",
                fix=f"Give an array of shape (N, {len(self)}).",
            )
        return values

    def __str__(self) -> str:
        return "Space of " + ", ".join(map(str, self.ranges))


class Design(Protocol):
    """The contract of a design."""

    def __call__(self, space: Space, samples: int, seed: int) -> np.ndarray:
        """Place points in the space, shape (N, n) with N at most `samples`."""


def grid(
    space: Space,
    samples: int | None = None,
    seed: int = 0,  # a grid leaves nothing to chance
    *,
    counts: int | Sequence[int] | None = None,
    step: float | Sequence[float] | None = None,
) -> np.ndarray:
    """Place a regular grid that includes all ends of the ranges; the last input varies fastest.

    Parameters
    ----------
    space : Space
        Ranges to place points in.
    samples : int, optional
        Most points in all: each input gets the same number of values, as many as fit.
    seed : int
        Not used.
    counts : int or n of them, optional
        Number of values of each input.
    step : float or n of them, optional
        Distance of the values, in the inputs' units; it has to divide the ranges.

    Raises
    ------
    UsageError
        Unless exactly one of `samples`, `counts` and `step` is given and makes at least two values per input.
    """
    if sum(given is not None for given in (samples, counts, step)) != 1:
        raise UsageError(
            "A grid needs one of samples, counts and step.",
            why=f"Given were samples={samples}, counts={counts}, step={step}.",
            fix="For example grid(space, step=0.01).",
        )
    if step is not None:
        counts = _counts_of(space, step)
    elif samples is not None:
        # the small term keeps an exact root from being rounded down
        counts = int(samples ** (1 / len(space)) + 1e-9)
    numbers = np.broadcast_to(np.asarray(counts, dtype=int), (len(space),))
    if numbers.min() < 2:
        raise _too_few(
            "grid", f"{numbers.tolist()} values per input", "at least 2 values per input, the ends"
        )
    axes = np.meshgrid(*(np.linspace(0, 1, count) for count in numbers), indexing="ij")
    return space.from_unit(np.stack([axis.ravel() for axis in axes], axis=1))


def sobol(space: Space, samples: int, seed: int = 0) -> np.ndarray:
    """Draw a scrambled Sobol sequence (Sobol 1967; Owen 1998), even from the first point on.

    Parameters
    ----------
    space : Space
        Ranges to place points in.
    samples : int
        Number of points; powers of two are balanced best, any other number will do.
    seed : int
        Seed of the scrambling.

    Returns
    -------
    (samples, n) array
        Points in the units of the ranges.
    """
    from scipy.stats import qmc

    _check_samples("Sobol design", samples)
    engine = qmc.Sobol(len(space), scramble=True, rng=np.random.default_rng(seed))
    power = int(np.ceil(np.log2(samples)))
    # a whole power of two is drawn: SciPy warns of any other number
    return space.from_unit(engine.random_base2(power)[:samples])


def random(space: Space, samples: int, seed: int = 0) -> np.ndarray:
    """Draw points independently and uniformly.

    Parameters
    ----------
    space : Space
        Ranges to place points in.
    samples : int
        Number of points.
    seed : int
        Seed of the generator.

    Returns
    -------
    (samples, n) array
        Points in the units of the ranges.
    """
    _check_samples("random design", samples)
    return space.from_unit(np.random.default_rng(seed).random((samples, len(space))))


DESIGNS: dict[str, Design] = {"grid": grid, "sobol": sobol, "random": random}
"""Designs by name."""


def design_points(design: str | Design, space: Space, samples: int, seed: int) -> np.ndarray:
    """Return the points (N, n) of a design, given itself or by name."""
    if not isinstance(design, str):
        return space.points(design(space, samples, seed))
    if design not in DESIGNS:
        raise UsageError(
            f"There is no design called {design!r}.",
            why=f"Known designs: {', '.join(DESIGNS)}.",
            fix="Choose one of these, or pass the points.",
        )
    return DESIGNS[design](space, samples, seed)


def _counts_of(space: Space, step: float | Sequence[float]) -> list[int]:
    steps = np.broadcast_to(np.asarray(step, dtype=float), (len(space),))
    counts = []
    for r, size in zip(space, steps, strict=True):
        intervals = (r.high - r.low) / size if size > 0 else 0.0
        if intervals < 1 or abs(intervals - round(intervals)) > 1e-6 * intervals:
            raise UsageError(
                f"A step of {size:g} {r.unit} does not divide the range {r}.",
                why=f"The range holds {intervals:g} steps.",
                fix="Choose a step that divides the range, or give counts.",
            )
        counts.append(round(intervals) + 1)
    return counts


def _check_samples(what: str, samples: int) -> None:
    if samples < 1:
        raise _too_few(what, f"{samples} samples", "at least one")


def _too_few(what: str, given: str, rule: str) -> UsageError:
    return UsageError(f"The {what} has {given}.", why=f"It needs {rule}.", fix="Ask for more.")
