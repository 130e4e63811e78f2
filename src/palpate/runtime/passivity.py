"""Time-domain passivity: a ledger of the energy that a hand has given, and damping where it got too much back.

The observer counts the work of the force *as sent* over the way that the hand went (Hannaford & Ryu 2002):

    E ← E − F·Δx        E in J: what the hand has put in, less what it was given back

A force of this tick acts on the way to the next sample, and `delay` seconds later where device and transport are
late, so that the sum is exact for a hold of zero order: with d = (n + f) T the force of the interval that has just
ended is f F[k−n−2] + (1 − f) F[k−n−1]. Where E < 0 the controller adds a damping α to the force:

    F ← F − α v        α = min(α_max, −E/(T |v|²)),  none below a speed of 1 mm/s

Damping already sent that has not acted yet counts towards E, so that a late device isn't damped several times for one
debt. The controller comes last: nothing but the largest force that the device bears bounds what it adds.

**The promise.** Let U be the energy that the hand feels and K its largest curvature, N/m. A force held for a tick
leaks at most ½ K |Δx|², one that is also d late at most K (½ + d/T) |Δx|², hence without any controller

    E ≥ U − K Σ (½ + d/T) |Δx|²

`PassivityController.leak` is the sum without K. The device's own damping b takes b T Σ|v|²: as long as K ≤ b/(T/2 + d),
the bound of `stability.passive_stiffness`, device and loop together never give energy. The controller is for all that
this sum doesn't know of: limits, faults, an outdated stiffness, an override.

**A body that gains energy by itself**, because another surrogate of it takes its place (`swap`), lowers the bound by
that energy, and no further: `PassivityController.added` counts the gains.

**Credit ends with the contact.** Energy that a body has swallowed is no licence to give it back later: outside a body,
and when the force is let go, E > 0 becomes 0. A debt stays.

References
----------
B. Hannaford, J.-H. Ryu (2002), Time-domain passivity control of haptic interfaces, IEEE Trans. Robotics and Automation
18(1), 1–10.
J.-H. Ryu, Y. S. Kim, B. Hannaford (2004), Sampled- and continuous-time passivity and stability of virtual environments,
IEEE Trans. Robotics 20(4), 772–776.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from palpate.errors import UsageError

__all__ = ["LEDGER", "LONGEST_DELAY", "PassivityController", "largest_damping"]

LONGEST_DELAY = 62  # ticks that a force may be late; longer delays are counted as this
_RING = LONGEST_DELAY + 2
_DEAD_BAND = 1e-3  # m/s: slower motion is noise of the encoder, and carries next to no energy
_SHARE = 0.5  # of m/(T + d): a damper sampled every T s and sent d s late is stable on the mass m below it

_ENERGY, _LOWEST, _DAMPING, _INJECTED, _LEAK, _SEEN, _HEAD = range(7)
LEDGER = 5  # the first ones, which are outputs
_PLACE = 7  # and the two behind it
_SIZE = 10

_jit = njit(cache=True, nogil=True, error_model="numpy")


def largest_damping(mass: float, rate: float, *, delay: float = 0.0) -> float:
    """Return the largest damping (N·s/m) that the controller may add: half of m/(T + d).

    Parameters
    ----------
    mass : float
        Apparent mass of the device at its handle, kg, without the hand.
    rate : float
        Ticks per second, Hz.
    delay : float
        From the device's sample to its force, beyond the hold of one tick, s.

    Raises
    ------
    UsageError
        If mass or rate is not positive, or the delay negative.
    """
    if not (mass > 0.0 and rate > 0.0 and delay >= 0.0):
        raise UsageError(
            f"No damping for a mass of {mass:g} kg, {rate:g} Hz and a delay of {delay:g} s.",
            fix="Give a positive mass and rate and no negative delay.",
        )
    return _SHARE * mass / (1.0 / rate + delay)


class PassivityController:
    """The energy ledger of one hand and the damping that keeps it from going below zero.

    Parameters
    ----------
    period : float
        Nominal time of a tick, s.
    max_force : float
        Largest ‖F‖ that may be sent, N; may change at any tick.
    max_damping : float
        α_max, N·s/m; 0 observes only, as for a device without motors.

    Attributes
    ----------
    state : (10,)
        All that the next step depends on besides its arguments, together with `sent`; may be copied and put back.
    ledger : (5,)
        A view of its outputs: E, lowest E, α, energy that damping was meant to take, and `leak`.
    sent : (64, 4)
        The latest forces, N, and the energy that the damping in each will take, J; a ring.
    delay : float
        From the device's sample to its force, s; may change at any tick.
    added : float
        Energy that the body has gained by no work of the hand, in all, J; see `book`.
    """

    def __init__(self, period: float, *, max_force: float, max_damping: float) -> None:
        if not (0.0 < period < math.inf and max_force > 0.0 and 0.0 <= max_damping < math.inf):
            raise UsageError(
                f"No passivity controller for a tick of {period:g} s, {max_force:g} N and {max_damping:g} N·s/m.",
                fix="Give a positive tick and force and no negative damping.",
            )
        self.period, self.max_force, self.max_damping = period, max_force, max_damping
        self.delay, self.added = 0.0, 0.0
        self.state, self.sent = np.zeros(_SIZE), np.zeros((_RING, 4))
        self.ledger = self.state[:LEDGER]
        self.apply(np.zeros(3), np.zeros(3), period)  # compile now, not in the loop
        self.state[:] = 0.0

    def book(self, gain: float) -> None:
        """Count energy (J) that the body has gained by no work of the hand, as while two surrogates are blended.

        The ledger itself stays what went through the hand: a gain shows there as the debt of a hand that gets it, and
        is damped. What the body has lost licenses no gain.
        """
        self.added += max(gain, 0.0)

    @property
    def energy(self) -> float:
        """Observed energy E: put in by the hand, less what it was given back, J."""
        return float(self.state[_ENERGY])

    @property
    def lowest(self) -> float:
        """The lowest E so far, J."""
        return float(self.state[_LOWEST])

    @property
    def damping(self) -> float:
        """Damping α that the latest step added, N·s/m."""
        return float(self.state[_DAMPING])

    @property
    def injected(self) -> float:
        """Energy that added damping was meant to take, in all, J."""
        return float(self.state[_INJECTED])

    @property
    def leak(self) -> float:
        """Σ (½ + d/T) |Δx|², m²: times the felt stiffness the most that sampling can have leaked."""
        return float(self.state[_LEAK])

    def apply(self, position: np.ndarray, force: np.ndarray, elapsed: float, *, free: bool = False) -> None:
        """Count the way from the last position, and damp the force where the ledger is below zero.

        Parameters
        ----------
        position : (3,)
            The hand, m.
        force : (3,)
            What would be sent, N, in the same axes; overwritten by what shall be sent.
        elapsed : float
            Since the last step, s.
        free : bool
            Whether nothing is touched: then a credit ends.
        """
        _step(
            self.state,
            self.sent,
            position,
            force,
            elapsed if elapsed > 0.0 else self.period,
            self.delay / self.period,
            self.max_force,
            self.max_damping,
            free,
        )

    def interrupt(self) -> None:
        """Note a tick of zero force on a hand whose way isn't known; a credit ends, a debt stays."""
        self.state[_HEAD] = (self.state[_HEAD] + 1.0) % _RING
        self.amend()
        self.state[_SEEN] = 0.0
        self.state[_DAMPING] = 0.0
        self.state[_ENERGY] = min(self.energy, 0.0)

    def amend(self) -> None:
        """Note that the force of the latest step was not delivered."""
        self.sent[int(self.state[_HEAD])] = 0.0


@_jit
def _step(state, sent, position, force, elapsed, late, max_force, max_damping, free):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    head = int(state[_HEAD])
    late = min(max(late, 0.0), float(LONGEST_DELAY))
    whole = int(late)
    part = late - whole
    newer, older = (head - whole) % _RING, (head - whole - 1) % _RING
    square, work = 0.0, 0.0
    if state[_SEEN] > 0.0:
        for i in range(3):
            way = position[i] - state[_PLACE + i]
            square += way * way
            work += ((1.0 - part) * sent[newer, i] + part * sent[older, i]) * way
        state[_ENERGY] -= work
        state[_LEAK] += (0.5 + late) * square
    energy = state[_ENERGY]
    state[_LOWEST] = min(state[_LOWEST], energy)
    if free and energy > 0.0:
        energy = state[_ENERGY] = 0.0
    pending = 0.0
    for j in range(whole):
        pending += sent[(head - j) % _RING, 3]
    damping, taken = 0.0, 0.0
    debt = -(energy + pending)
    if debt > 0.0 and square > (_DEAD_BAND * elapsed) ** 2:
        damping = min(max_damping, debt * elapsed / square)
        taken = damping * square / elapsed
        for i in range(3):
            force[i] -= damping * (position[i] - state[_PLACE + i]) / elapsed
        size = math.sqrt(force[0] ** 2 + force[1] ** 2 + force[2] ** 2)
        if size > max_force:
            for i in range(3):
                force[i] *= max_force / size
    state[_DAMPING] = damping
    state[_INJECTED] += taken
    head = (head + 1) % _RING
    state[_HEAD], state[_SEEN] = head, 1.0
    for i in range(3):
        state[_PLACE + i] = position[i]
        sent[head, i] = force[i]
    sent[head, 3] = taken
