"""A field's arrays for the evaluator core: rest and modes as whole numbers of two bytes, each with its own scale.

A mode is not kept more precisely than the eye needs. At any touch the field may be off by

    Σ_k |c_k| q_k / 2  ≤  0.9e-4 · (largest change of the field from rest)

c_k being the coefficients and q_k the scales. The scales are q_k = t / max |c_k|, so that every mode has an equal part
in the error, with the largest t that keeps the bound at all trained touches, and at others in the ranges and as far
beyond them as the field is followed; a mode that would need more than two bytes takes the finest scale that they allow.
Numbers of later modes are small then, and pack well.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError
from palpate.export.weights_block import BASELINE, FIELD, FIELD_NET, Table, net_tables
from palpate.surrogates import FieldSurrogate, Surrogate
from palpate.units import bounds

__all__ = ["PROMISE", "SURFACE", "VARIED", "RoundedModes", "chosen_field", "deepest_touches", "field_tables"]

SURFACE, VARIED = 49, 52  # places of the field's surface and varied tables in the block
PROMISE = 1e-4  # error over a field's largest change, to which the exported field keeps
_LARGEST = 32767  # largest number of int16, in which modes are rounded
# share of the promise that rounding the modes may use up; the rest is for places, and for single precision
_SHARE = 0.9
_DEEPEST = 24  # touches from which the largest change is taken
_HALVINGS = 60  # halvings in the search for the steps of the modes
_OTHERS = 1000  # places beside the trained ones at which modes are held precise enough


@dataclass(frozen=True, eq=False)
class RoundedModes:
    """Rest and modes of a field as whole numbers of two bytes."""

    scales: np.ndarray  # (1 + k,), what 1 stands for in the rest and in each mode
    small: np.ndarray  # (1 + k, nodes, components) int16: the rest, then the modes

    @classmethod
    def of(cls, surrogate: Surrogate, shown: FieldSurrogate) -> RoundedModes:
        """Return the modes of a body's field, rounded as the head of this file says."""
        rows = np.concatenate([shown.rest[None], shown.modes])
        size = np.abs(rows).reshape(len(rows), -1)
        largest = size.max(axis=1, initial=0.0)
        # a mode of zeros, or of one number everywhere, as a stretch at rest
        exact = ((size == 0.0) | (size == largest[:, None])).all(axis=1)
        finest, X = largest / _LARGEST, _all_touches(surrogate, shown)
        share = np.hstack([np.ones((len(X), 1)), np.abs(shown.coefficients(X))]) * ~exact
        most = np.maximum(share.max(axis=0, initial=0.0), 1e-300)
        allowed = 2.0 * _SHARE * PROMISE * _largest_change(shown, deepest_touches(surrogate, shown))
        low, high = 0.0, allowed
        for _ in range(_HALVINGS):
            t = (low + high) / 2.0
            fits = (share @ np.minimum(np.maximum(finest, t / most), largest)).max(initial=0.0) <= allowed
            low, high = (t, high) if fits else (low, t)
        scales = np.where(exact, largest, np.minimum(np.maximum(finest, low / most), largest))
        safe = np.where(scales > 0.0, scales, 1.0)
        return cls(scales, np.rint(rows / safe[:, None, None]).astype(np.int16))

    def error(self, coefficients: np.ndarray) -> float:
        """Return the most by which a field of these coefficients (N, k) can be off, in the field's unit."""
        return float((self.scales[0] + np.abs(coefficients) @ self.scales[1:]).max(initial=0.0) / 2.0)


def _trained_touches(surrogate: Surrogate, shown: FieldSurrogate) -> np.ndarray:
    """Return trained inputs (N, n) at which the probe touches."""
    X = surrogate.hand_energy.trained_rows()
    return X[surrogate.hand_energy.inside(X) & (shown.depth(X) > 0.0)]


def _all_touches(surrogate: Surrogate, shown: FieldSurrogate) -> np.ndarray:
    """Return trained touches (N, n), and others in the ranges and beyond them, where coefficients may be larger."""
    going, baseline = shown.continuation, surrogate.hand_energy.baseline
    assert going is not None
    low, high = bounds(shown.inputs)
    unit = np.random.default_rng(0).uniform(size=(_OTHERS, len(low)))
    X = (low - going.widths) + unit * (high - low + 2.0 * going.widths)
    radius = shown.radius if shown.radius_input is None else X[:, shown.radius_input]
    depth = shown.depth(X)
    return np.vstack(
        [_trained_touches(surrogate, shown), X[(depth > 0.0) & (depth <= baseline.inner + radius)]]
    )


def deepest_touches(surrogate: Surrogate, shown: FieldSurrogate) -> np.ndarray:
    """Return the deepest trained touches (N, n) of a body, at most 24."""
    X = _trained_touches(surrogate, shown)
    return X[np.argsort(shown.depth(X))[-_DEEPEST:]]


def _largest_change(shown: FieldSurrogate, X: np.ndarray) -> float:
    """Return the largest size of a field's change from rest at inputs X (N, n), in its unit."""
    change = shown.values(X) - shown.rest
    return float(np.sqrt((change**2).sum(axis=2)).max(initial=0.0))


def chosen_field(surrogate: Surrogate, name: str | None) -> str | None:
    """Return the field that goes out: the one that is named, or the displacement, or none."""
    if name is not None and name not in surrogate.fields:
        raise UsageError(
            f"The body has no field {name!r}.",
            why=f"It has {', '.join(surrogate.fields) or 'none'}.",
            fix="Name one of these, or leave the field out.",
        )
    if name is None:
        shown = {key: field for key, field in surrogate.surface_fields.items() if field.contact is None}
        name = "displacement" if "displacement" in shown else next(iter(shown), None)
    return name


def field_tables(surrogate: Surrogate, name: str, known: Mapping[int, Table]) -> dict[int, Table]:
    """Return the arrays of a field in their places; `known` are those of its energy, among them of the same surface.

    The core does not know fields at the nodes of a bent body.
    """
    shown = surrogate.surface_fields.get(name)
    if shown is None:
        raise UsageError(
            f"The field {name!r} is one at the nodes of a bent body, and the evaluator core knows fields on surfaces.",
            fix="Take it by `palpate export c`, `lib` or `fmu`, without a field; force and energy are the same.",
        )
    if shown.contact is not None:
        raise UsageError(
            f"The field {name!r} under a tool that turns, or on a curved surface, has no exported form yet.",
            why="Where it touches follows from all balls of the tool's front, which the evaluator core takes for the "
            "energy alone.",
            fix="Take it by `palpate export c`, `lib` or `fmu`, without a field; force, torque, energy are the same.",
        )
    going, mode = shown.continuation, shown.local_mode
    assert going is not None
    n_nodes, components = shown.rest.shape
    own = -1 if shown.radius_input is None else shown.radius_input
    rounded = RoundedModes.of(surrogate, shown)
    knots = 0 if mode is None else mode.table.shape[1]
    low, high = bounds(shown.inputs)
    reach, nodes, points = shown.moving_arguments()
    numbers = [shown.radius, going.deepest, going.depth_width, *shown.amplitude.numbers(), reach]
    tables = {
        FIELD: Table.of(np.array([n_nodes, components, len(shown.modes), own, knots])),
        FIELD + 1: Table.of(np.array(numbers)),
        FIELD + 2: Table.of(np.array([low, high, going.widths])),
        FIELD + 3: Table.of(rounded.scales),
        FIELD + 4: Table.of(rounded.small.reshape(1 + len(shown.modes), -1)),
        **net_tables(shown.network, FIELD_NET, 0),
        **{SURFACE + i: known[BASELINE + 1 + i] for i in range(3)},
    }
    if mode is not None:
        # the core's contact points lie on the surface that takes places: a field's own less its shift
        shift = np.array(shown.shift)
        tables |= {
            FIELD + 5: Table.of(mode.table),
            FIELD + 6: Table.of(nodes),
            FIELD + 7: Table.of(points - shift),
        }
        if mode.variation is not None:
            varied = mode.variation
            q, m = varied.table.shape[:2]
            scales = varied.scales.copy()
            scales[0, : len(varied.axes)] -= varied.axes @ shift
            arrays = (varied.table.reshape(q * m, -1), varied.powers, varied.axes, scales)
            tables |= {VARIED + i: Table.of(a) for i, a in enumerate(arrays)}
    return tables
