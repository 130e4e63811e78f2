"""One time step of a relaxation, compiled, without allocation; `relaxation` tells what it computes.

Arguments that recur:

    phi (M,)     φ_j = q e_j, amplitude that the probe asks of each patch, √J
    beta         β, root of the body's share of the compliance
    Z (M, n)     remembered amplitude of each patch and branch, √J
    keeps (3, n) shares of the old distance left after the hold before the move, after it, and after both
"""

from __future__ import annotations

import math

from palpate.kernels import kernel, part

__all__ = ["advance", "answer", "beta_of", "pattern_into", "step_into", "width_into"]

FAR = 18.0  # a patch whose share σ is exp(−18) of the nearest one's, 2e-8, counts as untouched
ASLEEP = 1e-9  # √J: memory of 1e-18 J is forgotten, so that patches can rest
SUBSTEP = 0.1  # longest step over the shortest relaxation time; recovery is integrated to first order
MOST = 64  # substeps of a step, at most
BEFORE, AFTER, BOTH = 0, 1, 2  # rows of `keeps`


@part
def width_into(q, law, width) -> None:
    """w in m and d ln w/d ln q into width (2,), with `law` = (w₁, √(2U₁), w₀)."""
    grown = law[0] * law[0]
    if law[1] > 0.0:
        grown *= (q / law[1]) ** (2.0 / 3.0)
    whole = max(grown + law[2] * law[2], 1e-30)
    width[0] = math.sqrt(whole)
    width[1] = grown / (3.0 * whole) if law[1] > 0.0 else 0.0


@part
def _reach(j, points, centre, width):
    """|x_j − c|²/2w²."""
    d = 0.0
    for a in range(3):
        d += (points[j, a] - centre[a]) ** 2
    return d / (2.0 * width * width)


@part
def pattern_into(centre, points, width, e, mean) -> None:
    """e_j = √σ_j into e (M,); Σ σ_j x_j, m, and Σ σ_j |x_j − c|²/2w² into mean (4,)."""
    least = math.inf
    for j in range(e.size):
        e[j] = _reach(j, points, centre, width)
        least = min(least, e[j])
    total = 0.0
    mean[:] = 0.0
    for j in range(e.size):
        reach = e[j]
        e[j] = math.exp(0.5 * (least - reach)) if reach - least < FAR else 0.0
        share = e[j] * e[j]
        total += share
        mean[3] += share * reach
        for a in range(3):
            mean[a] += share * points[j, a]
    mean /= total
    scale = 1.0 / math.sqrt(total)
    for j in range(e.size):
        e[j] *= scale


@part
def beta_of(q: float, pad: float) -> float:
    """β at q = √(2U), with `pad` = √(2U_a)."""
    if pad <= 0.0:
        return 1.0
    # a q between two steps may be rounded below zero
    ratio = (max(q, 0.0) / pad) ** (1.0 / 3.0)
    return math.sqrt(ratio / (1.0 + ratio))


@part
def _mean(j, Z, shares):
    """Y_j = Σ γ_i z_ij."""
    y = 0.0
    for i in range(shares.size):
        y += shares[i] * Z[j, i]
    return y


@part
def _stored(j, asked, beta, Z, shares):
    """Energy of one patch, J: ½(φ − βY)₊² + ½Σγz² − ½Y²."""
    y, squares = 0.0, 0.0
    for i in range(shares.size):
        y += shares[i] * Z[j, i]
        squares += shares[i] * Z[j, i] * Z[j, i]
    press = max(asked - beta * y, 0.0)
    return 0.5 * (press * press + squares - y * y)


@part
def _hold(j, asked, beta, Z, shares, keep, weight) -> None:
    """Let one patch relax under a probe that stays: p is the least of energy plus dissipation."""
    pull = 0.0
    for i in range(shares.size):
        pull += shares[i] * keep[i] * Z[j, i]
    if asked * weight > beta * pull:  # under the probe
        give = 1.0 - beta * beta
        shape = (beta * asked + give * pull) / (beta * beta + give * weight)
    else:  # free
        shape = pull / weight
    for i in range(shares.size):
        Z[j, i] = shape + keep[i] * (Z[j, i] - shape)


@part
def _weight(shares, keep):
    """γ_∞ + Σ γ_i k_i."""
    weight = 1.0
    for i in range(shares.size):
        weight -= shares[i] * (1.0 - keep[i])
    return weight


@part
def _recover(j, Z, shares, keep, weight, awake):
    """A hold of a patch that the probe doesn't reach; returns what is stored."""
    _hold(j, 0.0, 1.0, Z, shares, keep, weight)
    rest = True
    for i in range(shares.size):
        rest = rest and abs(Z[j, i]) < ASLEEP
    if rest:
        for i in range(shares.size):
            Z[j, i] = 0.0
        awake[j] = False
    return _stored(j, 0.0, 1.0, Z, shares)


@part
def advance(phi, beta, asked, q, part, beta_next, Z, shares, keeps, awake, ledger) -> None:
    """Hold, move phi a part of the way to q·asked at once, hold; the ledger gets stored, lost and work, J."""
    weights = (_weight(shares, keeps[BEFORE]), _weight(shares, keeps[AFTER]), _weight(shares, keeps[BOTH]))
    total, lost, work = 0.0, 0.0, 0.0
    for j in range(phi.size):
        here, there = phi[j], phi[j] + part * (q * asked[j] - phi[j])
        if here == 0.0 and there == 0.0:
            if awake[j]:
                old = _stored(j, 0.0, 1.0, Z, shares)
                stored = _recover(j, Z, shares, keeps[BOTH], weights[BOTH], awake)
                lost += max(old - stored, 0.0)
                total += stored
            continue
        awake[j] = True
        start = _stored(j, here, beta, Z, shares)
        _hold(j, here, beta, Z, shares, keeps[BEFORE], weights[BEFORE])
        y = _mean(j, Z, shares)
        press = max(here - beta * y, 0.0)
        held = _stored(j, here, beta, Z, shares)
        pressed = max(there - beta_next * y, 0.0)
        moved = 0.5 * (pressed - press) * (pressed + press)
        _hold(j, there, beta_next, Z, shares, keeps[AFTER], weights[AFTER])
        stored = _stored(j, there, beta_next, Z, shares)
        lost += max(start - held, 0.0) + max(held + moved - stored, 0.0)
        work += moved
        total += stored
        phi[j] = there
    ledger[0] = total
    ledger[1] += lost
    ledger[2] += work
    ledger[3] += lost


@part
def _keeps(dt, times, keeps) -> None:
    """e/a, a and e of each branch: so that an even press is exact."""
    for i in range(times.size):
        x = min(dt / times[i], 700.0)
        keeps[BEFORE, i] = x / math.expm1(x) if x > 0.0 else 1.0
        keeps[AFTER, i] = -math.expm1(-x) / x if x > 0.0 else 1.0
        keeps[BOTH, i] = math.exp(-x)


@part
def answer(centre, q, slope, phi, Z, work, constants, force) -> None:
    """F = −∂V/∂c into force (3,), N, for the patterns in `work`."""
    e, mean, width, _ = work
    points, _, shares, _, pad = constants
    force[:] = 0.0
    if q <= 0.0:
        return
    beta, w = beta_of(q, pad), width[0]
    along, held, wider = 0.0, 0.0, 0.0
    for j in range(phi.size):
        y = _mean(j, Z, shares)
        press = phi[j] - beta * y
        if phi[j] <= 0.0 or press <= 0.0:
            continue
        along += press * e[j]
        held += press * y
        wider += press * e[j] * (_reach(j, points, centre, w) - mean[3])
        for a in range(3):
            force[a] -= 0.5 * q / (w * w) * press * e[j] * (points[j, a] - mean[a])
    # d ln β/d ln q = (1 − β²)/6
    along += width[1] * wider - held * beta * (1.0 - beta * beta) / (6.0 * q)
    for a in range(3):
        force[a] -= along * slope[a]


@part
def _parts(dt, times) -> int:
    parts = 1
    for i in range(times.size):
        parts = max(parts, math.ceil(min(dt / (SUBSTEP * times[i]), float(MOST))))
    return parts


@kernel
def step_into(centre, q, slope, dt, force, ledger, state, work, constants) -> bool:
    """Take one step; see `RelaxationState.step`. Time that isn't positive is an instant."""
    phi, Z, awake, last = state
    e, mean, width, keeps = work
    points, law, shares, times, pad = constants
    total = q + dt
    for a in range(3):
        total += centre[a] + slope[a]
    if not math.isfinite(total) or q < 0.0:
        force[:] = 0.0
        return False
    old = last[0]
    width_into(q, law, width)
    pattern_into(centre, points, width[0], e, mean)
    parts = _parts(dt, times)
    _keeps(max(dt, 0.0) / parts, times, keeps)
    beta = beta_of(old, pad)
    ledger[3] = 0.0
    for m in range(parts):
        following = beta_of(old + (q - old) * (m + 1) / parts, pad)
        advance(phi, beta, e, q, 1.0 / (parts - m), following, Z, shares, keeps, awake, ledger)
        beta = following
    last[0] = q
    answer(centre, q, slope, phi, Z, work, constants, force)
    return True
