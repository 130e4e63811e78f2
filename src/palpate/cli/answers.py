"""What an energy of place answers at one place, for a person and for a program."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.format import share
from palpate.units import Range, bounds

__all__ = ["Answer", "beyond", "beyond_in_words", "outside", "place_in_words", "within_in_words"]

_NOTHING = 1e-9  # N: first touch, but for round-off


@dataclass(frozen=True)
class Answer:
    """What an energy answers at one place.

    Attributes
    ----------
    inputs : (n,)
        In the inputs' units.
    energy : float
        J.
    force : (3,)
        N.
    stiffness : (3, 3)
        ∂F/∂c by the first three inputs c, N/m.
    deviation : float
        Of the force, relative to its size; not-a-number where it is not known, as beyond the ranges.
    inside : bool
        Whether the place lies in what was trained.
    deepest : float, optional
        How far inside the touched surface (m) the probe's centre could go; given where the loop lets go of it. Energy,
        force and stiffness are not-a-number there.
    """

    inputs: np.ndarray
    energy: float
    force: np.ndarray
    stiffness: np.ndarray
    deviation: float
    inside: bool
    deepest: float | None = None

    def words(self, names: Sequence[Range]) -> str:
        """For a person."""
        at, told = place_in_words(self.inputs, names), beyond_in_words(self.inputs, names)
        told = f"\n  {told}" if told else ""
        if self.deepest is not None:
            return f"{at}\n  {_unknown(self.deepest)}{told}"
        size = float(np.linalg.norm(self.force))
        if size < _NOTHING:
            return f"{at}\n  no contact: force, stiffness and energy are zero{told}"
        largest = float(np.abs(self.stiffness).max())
        lines = [
            at,
            f"  force      {_row(self.force, size)} N, in all {size:.4g} N",
            f"  stiffness  {self.along():.4g} N/m along the force",
            f"  ∂F/∂c      {'; '.join(_row(row, largest) for row in self.stiffness)} N/m",
            f"  energy     {self.energy:.4g} J",
            f"  trust      {self._trust(names)}",
        ]
        return "\n".join(lines)

    def along(self) -> float:
        """−F·(∂F/∂c)F/‖F‖², N/m: what a hand feels that goes on pushing."""
        return float(-self.force @ self.stiffness @ self.force / (self.force @ self.force))

    def _trust(self, names: Sequence[Range]) -> str:
        where = within_in_words(self.inputs, names, inside=self.inside)
        sure = (
            "" if math.isnan(self.deviation) else f"± {share(self.deviation)} of the force, one deviation; "
        )
        return sure + where

    def ended(self, deepest: float) -> Answer:
        """The same place, where the body has let go of the probe."""
        none = math.nan
        return replace(
            self,
            energy=none,
            force=np.full(3, none),
            stiffness=np.full((3, 3), none),
            deviation=none,
            inside=False,
            deepest=deepest,
        )

    def as_dict(self, names: Sequence[Range]) -> dict[str, Any]:
        """For a program; `contact` is None where the body lets go, `beyond` the inputs out of range."""
        return {
            "inputs": self.inputs.tolist(),
            "force": self.force.tolist(),
            "stiffness": self.stiffness.tolist(),
            "energy": self.energy,
            "deviation": self.deviation,
            "inside": self.inside,
            "contact": None if self.deepest is not None else float(np.linalg.norm(self.force)) >= _NOTHING,
            "beyond": beyond(self.inputs, names),
        }


def outside(values: np.ndarray, inputs: Sequence[Range]) -> np.ndarray:
    """Which of the values (..., n) lie outside of their ranges."""
    low, high = bounds(inputs)
    return np.asarray((values < low) | (values > high))


def beyond(values: np.ndarray, inputs: Sequence[Range]) -> list[str]:
    """Names of the inputs whose values (n,) lie outside of their ranges."""
    return [r.name for r, out in zip(inputs, outside(values, inputs), strict=True) if out]


def place_in_words(values: np.ndarray, inputs: Sequence[Range]) -> str:
    """Names, values and units."""
    return "at " + ", ".join(_quantity(r, x) for r, x in zip(inputs, values, strict=True))


def beyond_in_words(values: np.ndarray, inputs: Sequence[Range]) -> str:
    """Values outside of their ranges, in words; "" if there are none."""
    return ", ".join(
        f"{_quantity(r, x)} is not in {r.low:.4g} … {r.high:.4g} {r.unit}".rstrip()
        for r, x, out in zip(inputs, values, outside(values, inputs), strict=True)
        if out
    )


def within_in_words(values: np.ndarray, inputs: Sequence[Range], *, inside: bool | None) -> str:
    """Whether values lie in what was trained; `inside` says whether a training sample is near, where that is known."""
    if told := beyond_in_words(values, inputs):
        return f"not known, OUTSIDE what it was trained on: {told}"
    if inside is None:
        return "within the ranges it was trained on"
    if not inside:
        return "OUTSIDE what it was trained on: within the ranges, but no training sample is near"
    return "inside what it was trained on"


def _unknown(deepest: float) -> str:
    return (
        f"no force is known here: a probe is followed to where its centre is {1e3 * deepest:.3g} mm beneath the "
        "touched\n  surface, not deeper and not behind the body: there the loop and the page let go of the hand"
    )


def _quantity(of: Range, value: float) -> str:
    return f"{of.name} {value:g} {of.unit}".rstrip()


def _row(values: np.ndarray, size: float) -> str:
    """Numbers; what is round-off beside `size` as zero."""
    return " ".join("0" if abs(value) < 1e-9 * size else f"{value:.4g}" for value in values)
