"""Networks as frozen values of a state or a refinement, with a record of the samples they were learnt from."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import astuple
from typing import Any

import numpy as np

from palpate.network import Network, Scaling
from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State
from palpate.rbf.refinement.refine import Refined
from palpate.rbf.regressors import Regressors
from palpate.units import Quantity, Range

__all__ = ["freeze", "freeze_refined", "frozen", "training_record"]


def freeze(
    state: State,
    settings: Settings,
    inputs: Sequence[Range],
    outputs: Sequence[Quantity],
    scaling: Scaling,
    *,
    basis: np.ndarray | None = None,
    meta: Mapping[str, Any] | None = None,
) -> Network:
    """The filter's state as a network value.

    Parameters
    ----------
    state : State
        The filter's state.
    settings : Settings
        Those it was learnt with.
    inputs, outputs : sequences of n ranges and m quantities
        Names and units of inputs and outputs, and the trained interval of each input.
    scaling : Scaling
        Between the state's quantities and physical ones.
    basis : (m, k), optional
        Output modes that the state's k outputs are.
    meta : mapping, optional
        What the network remembers of its training.
    """
    of = settings.regressors(state.inputs)
    return frozen(of, state.theta, state.coefficients, inputs, outputs, scaling, basis=basis, meta=meta)


def freeze_refined(
    found: Refined,
    inputs: Sequence[Range],
    outputs: Sequence[Quantity],
    scaling: Scaling,
    *,
    meta: Mapping[str, Any] | None = None,
) -> Network:
    """A refinement as a network value; `scaling` is what it was refined in."""
    # JSON has no infinity
    record = {
        "loo": found.loo if math.isfinite(found.loo) else None,
        "condition": found.condition,
        "refined": True,
    }
    return frozen(
        *(found.regressors, found.theta, found.coefficients, inputs, outputs, scaling),
        meta={**record, **(meta or {})},
    )


def frozen(
    regressors: Regressors,
    theta: np.ndarray,
    coefficients: np.ndarray,
    inputs: Sequence[Range],
    outputs: Sequence[Quantity],
    scaling: Scaling,
    *,
    basis: np.ndarray | None = None,
    meta: Mapping[str, Any] | None = None,
) -> Network:
    """Units θ (h, p) and coefficients (p_t + h, k), tail first, as a network value."""
    p_t = regressors.tail_size
    tail = np.zeros((coefficients.shape[1], 1 + regressors.form.inputs))
    tail[:, :p_t] = coefficients[:p_t].T
    factors, shifts = regressors.form.factors(theta)
    return Network(
        tuple(inputs),
        tuple(outputs),
        factors,
        shifts,
        coefficients[p_t:].T,
        tail,
        scaling,
        meta=dict(meta or {}),
        radial=regressors.radial,
        basis=basis,
    )


def training_record(X: np.ndarray, Y: np.ndarray, inputs: Sequence[Range]) -> dict[str, Any]:
    """The record of training samples for a network's `meta`: their number, and a hash that no other samples have.

    SHA-256 over the shapes, X and Y as little-endian doubles row by row, and the declared ranges.
    """
    digest = hashlib.sha256()
    shapes = [list(np.shape(X)), list(np.shape(Y))]
    digest.update(json.dumps([shapes, [astuple(r) for r in inputs]]).encode())
    for array in (X, Y):
        digest.update(np.ascontiguousarray(array, dtype="<f8").tobytes())
    return {"training": {"hash": digest.hexdigest(), "samples": len(X)}}
