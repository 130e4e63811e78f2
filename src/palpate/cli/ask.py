"""`palpate ask`: what a learnt body's file holds, and what the body answers at a place."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.cli.console import Console
from palpate.errors import UsageError
from palpate.surrogates import TouchedBody, TouchSurrogate
from palpate.surrogates.learnt_energy import LearntEnergy
from palpate.surrogates.loading import load
from palpate.units import Range, bounds
from palpate.words import share

__all__ = ["ask"]


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
        How far inside the touched surface (m) the probe's centre could go; given where it is farther, or elsewhere
        where nothing is known of its depth. Energy, force and stiffness are not-a-number there.
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
        at = ", ".join(_quantity(r, x) for r, x in zip(names, self.inputs, strict=True))
        beyond = self._beyond(names)
        if self.deepest is not None:
            return f"at {at}\n  {_unknown(self.deepest)}" + (f"\n  {beyond}" if beyond else "")
        size = float(np.linalg.norm(self.force))
        if size == 0.0:
            if beyond:
                return f"at {at}\n  no force: in the air, or behind the body\n  {beyond}"
            return f"at {at}\n  no contact: force, stiffness and energy are zero"
        largest = float(np.abs(self.stiffness).max())
        lines = [
            f"at {at}",
            f"  force      {_row(self.force, size)} N, in all {size:.4g} N",
            f"  stiffness  {self.along():.4g} N/m along the force",
            f"  ∂F/∂c      {'; '.join(_row(row, largest) for row in self.stiffness)} N/m",
            f"  energy     {self.energy:.4g} J",
            f"  trust      {self._trust(beyond)}",
        ]
        return "\n".join(lines)

    def along(self) -> float:
        """−F·(∂F/∂c)F/‖F‖², N/m: what a hand feels that goes on pushing."""
        return float(-self.force @ self.stiffness @ self.force / (self.force @ self.force))

    def _trust(self, beyond: str) -> str:
        if beyond:
            return f"not known, OUTSIDE what it was trained on: {beyond}"
        where = "inside what it was trained on"
        if not self.inside:
            where = "OUTSIDE what it was trained on: within the ranges, but no training solve is near"
        if math.isnan(self.deviation):
            return where
        return f"± {share(self.deviation)} of the force, one deviation; {where}"

    def _beyond(self, names: Sequence[Range]) -> str:
        """Inputs outside of their ranges, in words; "" if there are none."""
        return ", ".join(
            f"{_quantity(r, x)} is not in {r.low:.4g} … {r.high:.4g} {r.unit}".rstrip()
            for r, x, out in zip(names, self.inputs, _outside(self.inputs, names), strict=True)
            if out
        )

    def ended(self, deepest: float) -> Answer:
        """The same place, where nothing is known of how deep the probe is."""
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

    def as_dict(self) -> dict[str, Any]:
        """For a program."""
        return {
            "inputs": self.inputs.tolist(),
            "force": self.force.tolist(),
            "stiffness": self.stiffness.tolist(),
            "energy": self.energy,
            "deviation": self.deviation,
            "inside": self.inside,
        }


def ask(model: Path, at: Sequence[str], console: Console) -> None:
    """Print what a file holds; with places, what it answers there instead.

    Raises
    ------
    FileFormatError
        If the file is missing or damaged.
    UsageError
        If a place is not as many numbers as there are inputs, or the file's body has no energy to ask.
    """
    found = load(model)
    energy = found.touch if isinstance(found, TouchedBody) else found
    if not at:
        ranges = [{"name": r.name, "low": r.low, "high": r.high, "unit": r.unit} for r in energy.inputs]
        content = {"model": str(model), "kind": type(found).__name__, "inputs": ranges, "text": str(found)}
        console.result(f"{type(found).__name__} in {model}\n{found}", content)
        return
    if not isinstance(energy, LearntEnergy):
        raise UsageError(
            f"{model} holds a {type(found).__name__}, which does not answer at a place.",
            why="Bodies that are pressed or gripped have an energy of place; others answer to a hand that moves.",
            fix="Try `palpate run` or `palpate view`, or the value that `pp.load` reads.",
        )
    X = np.array([_place(text, energy.inputs) for text in at])
    known = energy.deviation(X) if energy.root is not None else np.full(len(X), math.nan)
    forces = energy.force(X)
    # a deviation is of what is like the training, and says nothing beyond it; that nothing is touched is exact
    known[_outside(X, energy.inputs).any(axis=1) & forces.any(axis=1)] = math.nan
    columns = energy.energy(X), forces, energy.stiffness(X), known, energy.inside(X)
    answers = [
        Answer(x, float(U), F, K, float(d), bool(i)) for x, U, F, K, d, i in zip(X, *columns, strict=True)
    ]
    if isinstance(energy, TouchSurrogate):
        measured = energy.surface.measured(X[:, :3]) | ~forces.any(axis=1)
        end = energy.surface.inner
        answers = [one if known else one.ended(end) for one, known in zip(answers, measured, strict=True)]
    words = [one.words(energy.inputs) for one in answers]
    if {"relaxation", "yielding"} & set(energy.meta):
        words.append(
            "This is the elastic answer, that of an instant: the body remembers, which `palpate run` shows."
        )
    console.result("\n".join(words), {"model": str(model), "answers": [one.as_dict() for one in answers]})


def _place(text: str, inputs: Sequence[Range]) -> list[float]:
    """Numbers with commas or blanks between them, as many as there are inputs."""
    try:
        found = [float(word) for word in text.replace(",", " ").split()]
    except ValueError:
        found = []
    if len(found) != len(inputs) or not all(map(math.isfinite, found)):
        names = ", ".join(f"{r.name} ({r.unit})" if r.unit else r.name for r in inputs)
        example = ",".join(f"{(r.low + r.high) / 2:.4g}" for r in inputs)
        raise UsageError(
            f"{text!r} is no place of this model.",
            why=f"It has {len(inputs)} inputs: {names}.",
            fix=f"Give as many numbers with commas between, for example --at {example}.",
        )
    return found


def _outside(values: np.ndarray, inputs: Sequence[Range]) -> np.ndarray:
    """Which of the values (..., n) lie outside of their ranges."""
    low, high = bounds(inputs)
    return np.asarray((values < low) | (values > high))


def _unknown(deepest: float) -> str:
    return (
        f"no force is known here: a probe is followed to where its centre is {1e3 * deepest:.3g} mm beneath the "
        "touched\n  surface, not deeper, nor behind the body or beside it; the loop and the page let go of the hand"
    )


def _quantity(of: Range, value: float) -> str:
    return f"{of.name} {value:g} {of.unit}".rstrip()


def _row(values: np.ndarray, size: float) -> str:
    """Numbers; what is round-off beside `size` as zero."""
    return " ".join("0" if abs(value) < 1e-9 * size else f"{value:.4g}" for value in values)
