"""Designs: where in a space to sample. Each is a function (space, samples, seed) -> points (N, n).

A new design is one more such function, entered in `DESIGNS` under its name.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from palpate.errors import UsageError
from palpate.sweeps.space import Space

__all__ = ["DESIGNS", "Design", "design_points", "grid", "random", "sobol"]


class Design(Protocol):
    """What a sweep asks of a design."""

    def __call__(self, space: Space, samples: int, seed: int) -> np.ndarray:
        """Points in the space, shape (N, n) with N at most `samples`."""


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
    samples : int, optional
        Most points in all: each input gets the same number of values, as many as fit.
    seed : int
        Not used.
    counts : int or n of them, optional
        Number of values of each input.
    step : float or n of them, optional
        Distance of the values, in the inputs' units; it has to divide the ranges.

    Returns
    -------
    (N, n) array

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
    samples : int
        How many; powers of two are balanced best, any other number will do.
    seed : int

    Returns
    -------
    (samples, n) array
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
    samples, seed : int

    Returns
    -------
    (samples, n) array
    """
    _check_samples("random design", samples)
    return space.from_unit(np.random.default_rng(seed).random((samples, len(space))))


DESIGNS: dict[str, Design] = {"grid": grid, "sobol": sobol, "random": random}
"""Every design by its name."""


def design_points(design: str | Design, space: Space, samples: int, seed: int) -> np.ndarray:
    """Points (N, n) of a design, given itself or by name.

    Raises
    ------
    UsageError
        If there is no design of this name.
    """
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
