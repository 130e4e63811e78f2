"""One time step of the memory, compiled, without allocation; `memory` tells what it computes.

Arguments that recur:

    phi (M,)    φ_j = q e_j, amplitude that the probe asks of each patch, √J
    beta        β, root of the body's share of the compliance
    Z (M, n)    remembered amplitude of each patch and branch, √J
    keep (n,)   share of the old distance that is left after a hold
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

__all__ = ["answer", "beta_of", "hold", "move", "pattern_into", "step_into", "stored_energy"]

FAR = 36.0  # a patch whose share σ is exp(−36) of the nearest one's counts as untouched
ASLEEP = 1e-12  # √J: memory of 1e-24 J is forgotten, so that patches can rest
SUBSTEP = 0.1  # longest step over the shortest relaxation time; recovery is integrated to first order
MOST = 64  # substeps

_jit = njit(cache=True, nogil=True, error_model="numpy")


@_jit
def pattern_into(centre, points, width, e, mean) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """e_j = √σ_j into e (M,), and Σ σ_j x_j into mean (3,), m."""
    least = math.inf
    for j in range(e.size):
        d = 0.0
        for a in range(3):
            d += (points[j, a] - centre[a]) ** 2
        e[j] = d / (2.0 * width * width)
        least = min(least, e[j])
    total = 0.0
    mean[:] = 0.0
    for j in range(e.size):
        d = e[j] - least
        e[j] = math.exp(-0.5 * d) if d < FAR else 0.0
        share = e[j] * e[j]
        total += share
        for a in range(3):
            mean[a] += share * points[j, a]
    for a in range(3):
        mean[a] /= total
    scale = 1.0 / math.sqrt(total)
    for j in range(e.size):
        e[j] *= scale


@_jit
def beta_of(q: float, pad: float) -> float:
    """β at q = √(2U), with `pad` = √(2U_a)."""
    if pad <= 0.0:
        return 1.0
    ratio = (q / pad) ** (1.0 / 3.0)
    return math.sqrt(ratio / (1.0 + ratio))


@_jit
def _mean(j, Z, shares):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Y_j = Σ γ_i z_ij."""
    y = 0.0
    for i in range(shares.size):
        y += shares[i] * Z[j, i]
    return y


@_jit
def _stored(j, asked, beta, Z, shares):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Energy of one patch, J: ½(φ − βY)₊² + ½Σγz² − ½Y²."""
    y, squares = 0.0, 0.0
    for i in range(shares.size):
        y += shares[i] * Z[j, i]
        squares += shares[i] * Z[j, i] * Z[j, i]
    press = max(asked - beta * y, 0.0)
    return 0.5 * (press * press + squares - y * y)


@_jit
def stored_energy(phi, beta, Z, shares):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """V in J."""
    total = 0.0
    for j in range(phi.size):
        total += _stored(j, phi[j], beta, Z, shares)
    return total


@_jit
def _shape(j, asked, beta, Z, shares, keep):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Amplitude of a patch at the end of a hold: the least of energy plus dissipation."""
    weight, pull = 1.0, 0.0
    for i in range(shares.size):
        weight -= shares[i] * (1.0 - keep[i])
        pull += shares[i] * keep[i] * Z[j, i]
    if asked * weight > beta * pull:  # under the probe
        give = 1.0 - beta * beta
        return (beta * asked + give * pull) / (beta * beta + give * weight)
    return pull / weight  # free


@_jit
def hold(phi, beta, Z, shares, keep, awake):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Let the memory relax under a probe that stays; returns the energy lost, J, which is never negative."""
    lost = 0.0
    for j in range(phi.size):
        if not awake[j]:
            continue
        before = _stored(j, phi[j], beta, Z, shares)
        shape = _shape(j, phi[j], beta, Z, shares, keep)
        rest = phi[j] == 0.0
        for i in range(shares.size):
            Z[j, i] = shape + keep[i] * (Z[j, i] - shape)
            rest = rest and abs(Z[j, i]) < ASLEEP
        if rest:
            Z[j] = 0.0
            awake[j] = False
        lost += max(before - _stored(j, phi[j], beta, Z, shares), 0.0)
    return lost


@_jit
def move(phi, beta, e, q, part, beta_next, Z, shares, awake):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Take phi a part of the way to q e, at once; returns the work of the hand, J."""
    work = 0.0
    for j in range(phi.size):
        following = phi[j] + part * (q * e[j] - phi[j])
        if following == 0.0 and phi[j] == 0.0:
            continue
        awake[j] = True
        y = _mean(j, Z, shares)
        old, new = max(phi[j] - beta * y, 0.0), max(following - beta_next * y, 0.0)
        work += 0.5 * (new - old) * (new + old)
        phi[j] = following
    return work


@_jit
def _keeps(dt, times, before, after) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Shares kept in the holds before and after the move: e/a and a, so that an even press is exact."""
    for i in range(times.size):
        x = min(dt / times[i], 700.0)
        before[i] = x / math.expm1(x) if x > 0.0 else 1.0
        after[i] = -math.expm1(-x) / x if x > 0.0 else 1.0


@_jit
def answer(phi, q, slope, e, mean, points, width, Z, shares, pad, force) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """F = −∂V/∂c into force (3,), N."""
    force[:] = 0.0
    if q <= 0.0:
        return
    beta = beta_of(q, pad)
    along, held = 0.0, 0.0
    for j in range(phi.size):
        y = _mean(j, Z, shares)
        press = phi[j] - beta * y
        if phi[j] <= 0.0 or press <= 0.0:
            continue
        along += press * e[j]
        held += press * y
        for a in range(3):
            force[a] -= 0.5 * q / (width * width) * press * e[j] * (points[j, a] - mean[a])
    # d ln β/d ln q = (1 − β²)/6
    along -= held * beta * (1.0 - beta * beta) / (6.0 * q)
    for a in range(3):
        force[a] -= along * slope[a] / q


@_jit
def step_into(centre, energy, slope, dt, force, ledger, state, work, constants) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """One step; see `Memory.step`. Time that isn't positive is an instant; what isn't finite changes nothing."""
    phi, Z, awake, last = state
    e, mean, before, after = work
    points, width, shares, times, pad = constants
    total = energy + dt
    for a in range(3):
        total += centre[a] + slope[a]
    if not math.isfinite(total) or energy < 0.0:
        force[:] = 0.0
        return False
    q, old = math.sqrt(2.0 * energy), last[0]
    pattern_into(centre, points, width, e, mean)
    parts = 1
    for i in range(times.size):
        parts = max(parts, min(MOST, int(math.ceil(min(dt / (SUBSTEP * times[i]), float(MOST))))))
    _keeps(max(dt, 0.0) / parts, times, before, after)
    lost = 0.0
    beta = beta_of(old, pad)
    for m in range(parts):
        lost += hold(phi, beta, Z, shares, before, awake)
        following = beta_of(old + (q - old) * (m + 1) / parts, pad)
        ledger[2] += move(phi, beta, e, q, 1.0 / (parts - m), following, Z, shares, awake)
        beta = following
        lost += hold(phi, beta, Z, shares, after, awake)
    last[0] = q
    ledger[0] = stored_energy(phi, beta, Z, shares)
    ledger[1] += lost
    ledger[3] = lost
    answer(phi, q, slope, e, mean, points, width, Z, shares, pad, force)
    return True
