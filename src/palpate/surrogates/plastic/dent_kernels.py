"""The loops behind `dents`: one step of a probe over a body that keeps dents."""

from __future__ import annotations

import math

from numba import njit

__all__ = ["step_into"]

_jit = njit(cache=True, nogil=True, error_model="numpy")


@_jit
def _weights_into(centre, points, width, weights, mean) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """w_j of a centre and their mean point; the nearest one's exponent is taken out, so that none underflows."""
    nearest = math.inf
    for j in range(weights.size):
        square = 0.0
        for a in range(3):
            square += (centre[a] - points[j, a]) ** 2
        weights[j] = square
        nearest = min(nearest, square)
    total = 0.0
    for j in range(weights.size):
        weights[j] = math.exp((nearest - weights[j]) / (2.0 * width * width))
        total += weights[j]
    mean[:] = 0.0
    for j in range(weights.size):
        weights[j] /= total
        for a in range(3):
            mean[a] += weights[j] * points[j, a]


@_jit
def _piece(x, knots):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Index of the piece of a table that x is in; the last one goes on."""
    i = 0
    while i < knots.size - 2 and x >= knots[i + 1]:
        i += 1
    return i


@_jit
def _stiffening(p, dent, table):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """κ and κ′ at p."""
    if p >= dent[-1]:
        return table[-1], 0.0
    i = _piece(p, dent)
    slope = (table[i + 1] - table[i]) / (dent[i + 1] - dent[i])
    return table[i] + slope * (p - dent[i]), slope


@_jit
def _dent_of(q, dent, reach):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """p on the virgin curve: Q(p) = q; never beyond q itself, also where the last piece goes on."""
    if q <= reach[0]:
        return 0.0
    i = _piece(q, reach)
    p = dent[i] + (dent[i + 1] - dent[i]) * (q - reach[i]) / (reach[i + 1] - reach[i])
    if q > reach[-1]:
        p = min(p, q - (reach[-1] - dent[-1]))  # the elastic part doesn't shrink
    return p


@_jit
def _stored(q, p, dent, table):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """V, J."""
    over = max(q - p, 0.0)
    return 0.5 * _stiffening(p, dent, table)[0] * over * over


@_jit
def _met(weights, depths):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """p(c) = Σ w_j p_j."""
    p = 0.0
    for j in range(weights.size):
        p += weights[j] * depths[j]
    return p


@_jit
def _grow(q, p, weights, depths, dent, reach):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Let the dents grow until Q(p) = q; returns the p that the probe meets."""
    wanted = _dent_of(q, dent, reach)
    if wanted <= p:
        return p
    squares = 0.0
    for j in range(weights.size):
        squares += weights[j] * weights[j]
    for j in range(weights.size):
        depths[j] += (wanted - p) * weights[j] / squares
    return wanted


@_jit
def step_into(centre, energy, slope, force, ledger, depths, work, constants) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """One step; see `DentMemory.step`."""
    weights, mean, along = work
    dent, reach, table, points, width = constants
    force[:] = 0.0
    total = energy
    for a in range(3):
        total += centre[a] + slope[a]
    if not math.isfinite(total) or energy < 0.0:
        return False
    q = math.sqrt(2.0 * energy)
    _weights_into(centre, points, width[0], weights, mean)
    p = _met(weights, depths)
    moved = _stored(q, p, dent, table)
    p = _grow(q, p, weights, depths, dent, reach)
    stored = _stored(q, p, dent, table)
    lost = max(moved - stored, 0.0)
    ledger[2] += stored - ledger[0] + lost
    ledger[0] = stored
    ledger[1] += lost
    ledger[3] = lost
    if q <= p:
        return True
    kappa, rise = _stiffening(p, dent, table)
    # ∇p = Σ p_j w_j (x_j − x̄)/w²
    along[:] = 0.0
    for j in range(weights.size):
        for a in range(3):
            along[a] += depths[j] * weights[j] * (points[j, a] - mean[a]) / (width[0] * width[0])
    over = q - p
    driving = kappa * over - 0.5 * rise * over * over
    for a in range(3):
        force[a] = -kappa * over * slope[a] / q + driving * along[a]
    return True
