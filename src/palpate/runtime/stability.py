"""Bounds on how stiff a body may feel before the sampled loop itself starts to push.

A force computed from a sample is held for a tick, and so trails the hand: the loop leaks energy in proportion
to the stiffness K and the tick T, and the device's own damping b must absorb it. With a virtual damping B:

- passive, whatever holds the device:   K < 2 (b − |B|)/T          (Colgate & Schenkel 1997)
- stable in a still hand, delay t_d:    K < (b + B)/(T/2 + t_d)    (Gil et al. 2009)

K is the felt stiffness in hand coordinates: the body's largest eigenvalue of ∂F/∂x over the trained range,
times the workspace scale (positions are scaled, forces are not).

References
----------
J. E. Colgate, G. G. Schenkel (1997), Passivity of a class of sampled-data systems: application to haptic
interfaces, J. Robotic Systems 14(1), 37–47.
J. J. Gil, E. Sánchez, T. Hulin, C. Preusche, G. Hirzinger (2009), Stability boundary for haptic rendering:
influence of damping and delay, J. Computing and Information Science in Engineering 9(1), 011005.
"""

from __future__ import annotations

from palpate.errors import UsageError

__all__ = ["passive_stiffness", "stable_stiffness", "stiffness_warning"]


def passive_stiffness(damping: float, rate: float, *, virtual_damping: float = 0.0) -> float:
    """Return the stiffness (N/m) below which the loop is passive; Colgate & Schenkel 1997.

    Parameters
    ----------
    damping : float
        The device's own, b, N·s/m.
    rate : float
        Ticks per second, Hz.
    virtual_damping : float
        B that the loop adds, N·s/m.

    Raises
    ------
    UsageError
        If the rate is not positive or the damping negative.
    """
    _check(damping, rate, 0.0)
    return max(0.0, 2.0 * (damping - abs(virtual_damping)) * rate)


def stable_stiffness(
    damping: float, rate: float, *, delay: float = 0.0, virtual_damping: float = 0.0
) -> float:
    """Return the stiffness (N/m) below which a loop with a transport delay (s) is stable; Gil et al. 2009.

    Raises
    ------
    UsageError
        If the rate is not positive, or damping or delay negative.
    """
    _check(damping, rate, delay)
    return max(0.0, (damping + virtual_damping) / (0.5 / rate + delay))


def stiffness_warning(
    stiffness: float, damping: float | None, rate: float, *, delay: float = 0.0
) -> str | None:
    """Return a warning for a body that is too stiff for the device, or None.

    Parameters
    ----------
    stiffness : float
        Felt, K, N/m: `Workspace.felt(model.stiffness_max)`.
    damping : float or None
        The device's own, N·s/m; None for one without motors, which can't become unstable.
    rate : float
        Ticks per second, Hz.
    delay : float
        From the device's sample to its force, beyond the hold of one tick, s.
    """
    if damping is None:
        return None
    passive = passive_stiffness(damping, rate)
    if stiffness < passive and delay == 0.0:
        return None
    stable = stable_stiffness(damping, rate, delay=delay)
    if stiffness < min(passive, stable):
        return None
    outcome = "it may hum in a tight grip" if stiffness < stable else "it will oscillate in a loose grip"
    return (
        f"The body feels as stiff as {stiffness:.0f} N/m, and {outcome}: with the device's damping of "
        f"{damping:g} N·s/m at {rate:.0f} Hz the loop is passive below {passive:.0f} N/m and, with "
        f"{1e3 * delay:g} ms of delay, stable below {stable:.0f} N/m. Use a larger workspace, a higher rate "
        "or a softer body."
    )


def _check(damping: float, rate: float, delay: float) -> None:
    if not (rate > 0.0 and damping >= 0.0 and delay >= 0.0):
        raise UsageError(
            f"No bound for a damping of {damping:g} N·s/m, {rate:g} Hz and a delay of {delay:g} s.",
            fix="Give a positive rate and no negative damping or delay.",
        )
