"""A field's arrays for the evaluator core: rest and modes as whole numbers of two bytes, each with its own scale."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from palpate.errors import UsageError
from palpate.export.weights_block import BASELINE, FIELD, FIELD_NET, Table, net_tables
from palpate.surrogates import FieldSurrogate, Surrogate

__all__ = ["SURFACE", "VARIED", "chosen_field", "field_tables", "rounding_error"]

SURFACE, VARIED = 49, 52
_LARGEST = 32767


def chosen_field(surrogate: Surrogate, name: str | None) -> str | None:
    """Return the field that goes out: the one that is named, or the displacement, or none.

    Raises
    ------
    UsageError
        If there is no field of that name.
    """
    if name is not None and name not in surrogate.fields:
        raise UsageError(
            f"The body has no field {name!r}.",
            why=f"It has {', '.join(surrogate.fields) or 'none'}.",
            fix="Name one of these, or leave the field out.",
        )
    if name is None:
        shown = [k for k, v in surrogate.fields.items() if isinstance(v, FieldSurrogate)]
        name = "displacement" if "displacement" in shown else next(iter(shown), None)
    return name


def field_tables(surrogate: Surrogate, name: str, known: Mapping[int, Table]) -> dict[int, Table]:
    """Return the arrays of a field in their places.

    Parameters
    ----------
    surrogate : Surrogate
        The body.
    name : str
        The field's name.
    known : mapping
        The arrays of its energy, among them those of the same surface.

    Raises
    ------
    UsageError
        If it is a field at the nodes of a bent body, which the core does not know.
    """
    shown = surrogate.fields[name]
    if not isinstance(shown, FieldSurrogate):
        raise UsageError(
            f"The field {name!r} is one at the nodes of a bent body, and the evaluator core knows fields on surfaces.",
            fix="Export the body without a field; its force and energy are the same.",
        )
    going, mode = shown.continuation, shown.local_mode
    assert going is not None
    n_nodes, components = shown.rest.shape
    own = -1 if shown.radius_input is None else shown.radius_input
    scales, small = _round_modes(shown)
    knots = 0 if mode is None else mode.table.shape[1]
    low, high = np.array([[r.low for r in shown.inputs], [r.high for r in shown.inputs]])
    reach, nodes, points = shown.moving_arguments()
    numbers = [shown.radius, going.deepest, going.depth_width, *shown.amplitude.numbers(), reach]
    tables = {
        FIELD: Table.of(np.array([n_nodes, components, len(shown.modes), own, knots])),
        FIELD + 1: Table.of(np.array(numbers)),
        FIELD + 2: Table.of(np.array([low, high, going.widths])),
        FIELD + 3: Table.of(scales),
        FIELD + 4: Table.of(small),
        **net_tables(shown.network, FIELD_NET, 0),
        **{SURFACE + i: known[BASELINE + 1 + i] for i in range(3)},
    }
    if mode is not None:
        tables |= {FIELD + 5: Table.of(mode.table), FIELD + 6: Table.of(nodes), FIELD + 7: Table.of(points)}
        if mode.variation is not None:
            varied = mode.variation
            q, m = varied.table.shape[:2]
            arrays = (varied.table.reshape(q * m, -1), varied.powers, varied.axes, varied.scales)
            tables |= {VARIED + i: Table.of(a) for i, a in enumerate(arrays)}
    return tables


def _round_modes(shown: FieldSurrogate) -> tuple[np.ndarray, np.ndarray]:
    """Return the scales (1 + k,) of rest and modes, and these as whole numbers (1 + k, nodes · components)."""
    rows = np.concatenate([shown.rest[None], shown.modes]).reshape(1 + len(shown.modes), -1)
    scales = np.abs(rows).max(axis=1, initial=0.0) / _LARGEST
    safe = np.where(scales > 0, scales, 1.0)
    return scales, np.rint(rows / safe[:, None]).astype(np.int16)


def rounding_error(shown: FieldSurrogate, coefficients: np.ndarray) -> float:
    """Return the most by which a field of these coefficients (N, k) can be off through rounding its modes.

    It is half a step of each mode times its coefficient, summed; in the field's unit.
    """
    scales, _ = _round_modes(shown)
    return float((scales[0] + np.abs(coefficients) @ scales[1:]).max(initial=0.0) / 2)
