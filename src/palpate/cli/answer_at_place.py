"""Answer of a model at one place, for a person and for a program: of an energy, or of numbers and fields."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from palpate.format import share
from palpate.surrogates import ModalField, Surrogate
from palpate.units import Quantity, Range, bounds

__all__ = [
    "Answer",
    "Deflection",
    "FieldSummary",
    "Prediction",
    "outside",
    "surrogate_answers",
]

_NOTHING = 1e-9  # N: first touch, but for round-off


@dataclass(frozen=True)
class Answer:
    """Answer of an energy at one place."""

    inputs: np.ndarray  # (n,) in the inputs' units
    energy: float  # J
    force: np.ndarray  # (3,) in N
    stiffness: np.ndarray  # (3, 3) ∂F/∂c by the first three inputs c, N/m
    # of the force, relative to its size; not-a-number where it is not known, as beyond the ranges
    deviation: float
    inside: bool  # whether the place lies in what was trained
    # how far inside the touched surface (m) the probe's centre could go, where the loop lets go of it; energy, force
    # and stiffness are not-a-number there
    deepest: float | None = None
    torque: np.ndarray | None = None  # (3,) in N m about the tool's place; None of a probe that tells none
    effort: float | None = None  # N, with which the body pushes two jaws apart; None of any other tool

    def words(self, names: Sequence[Range]) -> str:
        """Return the answer as lines for a person."""
        place, beyond = _place_in_words(self.inputs, names), _beyond_in_words(self.inputs, names)
        beyond = f"\n  {beyond}" if beyond else ""
        if self.deepest is not None:
            return f"{place}\n  {_unknown(self.deepest)}{beyond}"
        size = float(np.linalg.norm(self.force))
        if max(size, abs(self.effort or 0.0)) < _NOTHING:
            return f"{place}\n  no contact: force, stiffness and energy are zero{beyond}"
        largest = float(np.abs(self.stiffness).max())
        lines = [
            place,
            f"  force      {_row(self.force, size)} N, in all {size:.4g} N",
            *self._torque_in_words(),
            *(
                []
                if self.effort is None
                else [f"  effort     {self.effort:.4g} N, by which the jaws are pushed apart"]
            ),
            *([] if size < _NOTHING else [f"  stiffness  {self.along():.4g} N/m along the force"]),
            f"  ∂F/∂c      {'; '.join(_row(row, largest) for row in self.stiffness)} N/m",
            f"  energy     {self.energy:.4g} J",
            f"  trust      {self._trust(names)}",
        ]
        return "\n".join(lines)

    def along(self) -> float:
        """Return −F·(∂F/∂c)F/‖F‖², N/m: the stiffness that a hand feels when it pushes on."""
        return float(-self.force @ self.stiffness @ self.force / (self.force @ self.force))

    def _torque_in_words(self) -> list[str]:
        if self.torque is None:
            return []
        size = float(np.linalg.norm(self.torque))
        return [f"  torque     {_row(1e3 * self.torque, 1e3 * size)} mN m about the tool's foremost point"]

    def _trust(self, names: Sequence[Range]) -> str:
        where = _trust_in_words(self.inputs, names, inside=self.inside)
        if math.isnan(self.deviation):
            return where
        off = f"{share(self.deviation)} of the force"
        if self.effort is not None:  # the forces of two jaws cancel, their error does not
            off = f"{self.deviation * float(np.linalg.norm(self.force)):.2g} N in the force"
        return f"± {off}, one deviation; {where}"

    def ended(self, deepest: float) -> Answer:
        """Return the answer at this place where the body has let go of the probe."""
        none = math.nan
        return replace(
            self,
            energy=none,
            force=np.full(3, none),
            stiffness=np.full((3, 3), none),
            deviation=none,
            torque=None if self.torque is None else np.full(3, none),
            effort=None if self.effort is None else none,
            inside=False,
            deepest=deepest,
        )

    def as_dict(self, names: Sequence[Range]) -> dict[str, Any]:
        """Return the answer as data for a program.

        `contact` is None where the body lets go, `beyond` has the names of the inputs out of range.
        """
        return {
            "inputs": self.inputs.tolist(),
            "force": self.force.tolist(),
            **({} if self.torque is None else {"torque": self.torque.tolist()}),
            **({} if self.effort is None else {"effort": self.effort}),
            "stiffness": self.stiffness.tolist(),
            "energy": self.energy,
            "deviation": self.deviation,
            "inside": self.inside,
            "contact": None
            if self.deepest is not None
            else max(float(np.linalg.norm(self.force)), abs(self.effort or 0.0)) >= _NOTHING,
            "beyond": _names_beyond(self.inputs, names),
        }


@dataclass(frozen=True)
class FieldSummary:
    """The least, largest and mean value of a field or curve at one place of the inputs."""

    name: str
    unit: str
    least: float
    largest: float
    mean: float
    deviations: tuple[float, float]  # of the least and the largest, not-a-number where they are unknown
    places: tuple[str, str]  # where the least and the largest are, in words
    components: bool  # whether these are sizes of vectors

    @classmethod
    def of(cls, field: ModalField, x: np.ndarray) -> FieldSummary:
        """Return the summary of a field at inputs x (n,); of a vector field that of its size."""
        values, spread = field.values(x[None])[0], field.deviation(x[None])[0]
        size = values[:, 0] if values.shape[1] == 1 else np.linalg.norm(values, axis=1)
        sure = np.linalg.norm(spread, axis=1)
        low, high = int(size.argmin()), int(size.argmax())
        return cls(
            field.name,
            field.unit,
            *(float(size[low]), float(size[high]), float(size.mean())),
            (float(sure[low]), float(sure[high])),
            (field.places.in_words(low), field.places.in_words(high)),
            values.shape[1] > 1,
        )

    def words(self) -> str:
        """Return the summary as a line for a person."""

        def one(value: float, deviation: float, where: str) -> str:
            spread = "" if math.isnan(deviation) else f" ± {deviation:.2g}"
            return f"{value:.6g}{spread} {self.unit}".rstrip() + f" {where}"

        ends = zip((self.least, self.largest), self.deviations, self.places, strict=True)
        least, largest = (one(*end) for end in ends)
        size = " (size)" * self.components
        return f"  {self.name}{size}: {least} to {largest}, mean {self.mean:.6g} {self.unit}".rstrip()

    def as_dict(self) -> dict[str, Any]:
        """Return the summary as data for a program."""
        return asdict(self)


@dataclass(frozen=True)
class Prediction:
    """Numbers and fields of a surrogate without touch at one place."""

    inputs: np.ndarray  # (n,) in the inputs' units
    outputs: tuple[Quantity, ...]  # names and units of the m outputs
    values: np.ndarray  # (m,) in the outputs' units
    # (m,) of what would be measured; None where the file has none, not-a-number beyond the ranges
    deviations: np.ndarray | None
    inside: bool | None  # whether a training sample is near; None where the file does not tell
    fields: tuple[FieldSummary, ...] = ()

    def words(self, names: Sequence[Range]) -> str:
        """Return the answer as lines for a person."""
        lines = [_place_in_words(self.inputs, names)]
        width = max((len(output.name) for output in self.outputs), default=0)
        sure = [None] * len(self.values) if self.deviations is None else self.deviations
        for output, value, deviation in zip(self.outputs, self.values, sure, strict=True):
            spread = "" if deviation is None or math.isnan(deviation) else f" ± {deviation:.2g}"
            lines.append(f"  {output.name:{width}}  {value:.6g}{spread} {output.unit}".rstrip())
        lines += [one.words() for one in self.fields]
        return "\n".join([*lines, f"  trust: {_trust_in_words(self.inputs, names, inside=self.inside)}"])

    def as_dict(self, names: Sequence[Range]) -> dict[str, Any]:
        """Return the outputs as data for a program; `beyond` are the inputs out of range."""
        return {
            "inputs": self.inputs.tolist(),
            "outputs": {output.name: float(v) for output, v in zip(self.outputs, self.values, strict=True)},
            "deviations": None if self.deviations is None else self.deviations.tolist(),
            "inside": self.inside,
            "beyond": _names_beyond(self.inputs, names),
            **({"fields": {one.name: one.as_dict() for one in self.fields}} if self.fields else {}),
        }


@dataclass(frozen=True)
class Deflection:
    """Displacement of a beam under its loads."""

    inputs: np.ndarray  # (n,) loads in N
    nodes: np.ndarray  # (k, 3) nodes of interest at rest, m
    displacement: np.ndarray  # (k, 3) of these nodes, m

    def words(self, names: Sequence[Range]) -> str:
        """Return the displacement of each node of interest as lines for a person."""
        lines = [_place_in_words(self.inputs, names)]
        for place, moved in zip(self.nodes, self.displacement, strict=True):
            lines.append(f"  at {place[0]:.4g} m  u_x {1e3 * moved[0]:.4g} mm, u_y {1e3 * moved[1]:.4g} mm")
        beyond = _names_beyond(self.inputs, names)
        trust = (
            f"{', '.join(beyond)} beyond the range, taken at its end"
            if beyond
            else "within the range of the loads"
        )
        return "\n".join([*lines, f"  trust: {trust}"])

    def as_dict(self, names: Sequence[Range]) -> dict[str, Any]:
        """Return the displacement as data for a program; `beyond` are the loads out of range."""
        return {
            "inputs": self.inputs.tolist(),
            "nodes": self.nodes.tolist(),
            "displacement": self.displacement.tolist(),
            "beyond": _names_beyond(self.inputs, names),
        }


def surrogate_answers(surrogate: Surrogate, X: np.ndarray) -> list[Prediction]:
    """Return the numbers and fields of a surrogate at inputs X (N, n)."""
    spread, trusted = surrogate.deviation(X), surrogate.trusted(X)
    spread = np.where(outside(X, surrogate.inputs).any(axis=1, keepdims=True), math.nan, spread)
    numbers, fields = surrogate.quantities.values(), surrogate.modal_fields.values()
    # a network alone states neither
    tells = bool(fields) or any(part.uncertainty is not None or part.region is not None for part in numbers)
    return [
        Prediction(
            x,
            surrogate.outputs,
            y,
            s if tells else None,
            bool(i) if tells else None,
            tuple(FieldSummary.of(one, x) for one in fields),
        )
        for x, y, s, i in zip(X, surrogate.predict(X), spread, trusted, strict=True)
    ]


def outside(values: np.ndarray, inputs: Sequence[Range]) -> np.ndarray:
    """Return which of the values (..., n) lie outside of their ranges."""
    low, high = bounds(inputs)
    return np.asarray((values < low) | (values > high))


def _names_beyond(values: np.ndarray, inputs: Sequence[Range]) -> list[str]:
    """Return the names of the inputs whose values (n,) lie outside of their ranges."""
    return [r.name for r, out in zip(inputs, outside(values, inputs), strict=True) if out]


def _place_in_words(values: np.ndarray, inputs: Sequence[Range]) -> str:
    """Return names, values and units."""
    return "at " + ", ".join(_quantity(r, x) for r, x in zip(inputs, values, strict=True))


def _beyond_in_words(values: np.ndarray, inputs: Sequence[Range]) -> str:
    """Return values outside of their ranges, in words; "" if there are none."""
    return ", ".join(
        f"{_quantity(r, x)} is not in {r.low:.4g} … {r.high:.4g} {r.unit}".rstrip()
        for r, x, out in zip(inputs, values, outside(values, inputs), strict=True)
        if out
    )


def _trust_in_words(values: np.ndarray, inputs: Sequence[Range], *, inside: bool | None) -> str:
    """Return in words whether values lie in what was trained; `inside` is None where no sample is known to be near."""
    if beyond := _beyond_in_words(values, inputs):
        return f"not known, OUTSIDE what it was trained on: {beyond}"
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


def _quantity(quantity: Range, value: float) -> str:
    return f"{quantity.name} {value:g} {quantity.unit}".rstrip()


def _row(values: np.ndarray, size: float) -> str:
    """Return numbers as text; what is round-off beside `size` as zero."""
    return " ".join("0" if abs(value) < 1e-9 * size else f"{value:.4g}" for value in values)
