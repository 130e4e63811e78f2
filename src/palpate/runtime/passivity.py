"""Time-domain passivity on a real sensor: a ledger of energy, and damping where a hand gets more back than it gave.

**The ledger** counts the work of the force *as sent* over the way that the hand went (Hannaford & Ryu 2002):

    E ← E − F̄·Δx̄       E in J: what the hand has put in, less what it was given back

A force of this tick acts on the way to the next sample, and `delay` seconds later where device and transport are late:
with d = (n + f) T the force of the interval that has just ended is f F[k−n−2] + (1 − f) F[k−n−1]. Without noise the sum
is exact for a hold of zero order.

**Noise carries no energy.** A sensor's noise is no motion, but a body answers to it, and the raw sum takes the answer
for work. So place and force both pass the same low-pass of time constant τ, which leaves the work of motions slower
than 1/τ as it is, and the work is booked only once the filtered place has left a ball of three standard deviations of
its noise around the last booked one, with the mean force of the ticks between. (A play operator alone, with the force
as it is, would hide twice the ball's radius times the force in each stroke.) What is left, 3/2 K a² σ² a tick with
a = T/(τ + T), is a hundredth of what the raw sum makes of it, and none in a hand at rest. Without noise τ and the ball
vanish.

**What is damped** is not a ledger below zero, which shows only at the end of a contact, but one below the energy that
the body holds (Ryu et al. 2005): the learnt body states its energy U in each tick, so that a leak shows as it occurs.

    B ← B + ΔE − ΔŪ     F ← F − α v̄     α → min(α_max, −B/(P |v̄|²))

Ū is filtered alike, v̄ is the speed of the filtered place, P the time of 20 ms or 2τ in which a debt is paid and over
which α is filtered. While the force limit acts, neither work nor U counts: the hand doesn't put in what the body
states, and a constant force leaks nothing. A debt B < 0 is forgotten in a second, a credit in a fifth: who holds the
device has absorbed the energy by then, and what a body has swallowed is no licence to give it back. Damping already
sent that has not acted yet counts towards B.

**How much may be damped**: on the apparent mass m, α ≤ m/2(T + d + τ), which is stable without a hand; α times the
noise of the filtered speed stays below 2 % of the largest force; and below what the body itself answers to the noise,
½K(τ + T) for a felt stiffness K. The τ that leaves most is taken. Never more than the body's own force is damped: a
body that is left doesn't pull, and in the air nothing is felt.

**The promise.** Let U be the energy that the hand feels and K its largest curvature, N/m. A force held for a tick
leaks at most ½ K |Δx|², one that is also d late at most K (½ + d/T) |Δx|², hence without any controller

    E ≥ U − K Σ (½ + d/T) |Δx|²

`PassivityController.leak` is the sum without K, of the filtered place, with half the square of each way that was booked
at once; for an energy that is not quadratic the filter adds terms of third order. The device's own damping b takes
b T Σ|v|²: as long as K ≤ b/(T/2 + d), the bound of `stability.passive_stiffness`, device and loop together never give
energy. The controller is for all that this sum doesn't know of: limits, faults, an outdated stiffness, an override.

**A body that gains energy by itself**, because another surrogate of it takes its place (`swap`), lowers the bound by
that energy, and no further: `PassivityController.added` counts the gains.

**Credit ends with the contact.** Energy that a body has swallowed is no licence to give it back later: outside a body,
and when the force is let go, E > 0 becomes 0. A debt of E stays on record.

References
----------
B. Hannaford, J.-H. Ryu (2002), Time-domain passivity control of haptic interfaces, IEEE Trans. Robotics and Automation
18(1), 1–10.
J.-H. Ryu, Y. S. Kim, B. Hannaford (2004), Sampled- and continuous-time passivity and stability of virtual environments,
IEEE Trans. Robotics 20(4), 772–776.
J.-H. Ryu, C. Preusche, B. Hannaford, G. Hirzinger (2005), Time domain passivity control with reference energy
following, IEEE Trans. Control Systems Technology 13(5), 737–742.
"""

from __future__ import annotations

import math

import numpy as np

from palpate.devices.tick_record import LEDGER
from palpate.errors import UsageError
from palpate.kernels import kernel, part
from palpate.runtime.sensor_noise import NOISE_STATE, forget_motion, measure_noise

__all__ = ["LONGEST_DELAY", "PassivityController", "largest_damping"]

LONGEST_DELAY = 62  # ticks that a force may be late; longer delays are counted as this
_RING = LONGEST_DELAY + 2
_SLOWEST = 1e-4  # m/s: below it a speed is as good as none, and carries no energy
_SHARE = 0.5  # of m/(T + d): a damper sampled every T s and sent d s late is stable on the mass m below it
_PAYBACK = 0.020  # s in which a debt is paid: shorter than a hand notices, longer than a tick of a slow loop
# s in which debt and credit are forgotten: who holds the device has absorbed them by then
_DEBT_MEMORY, _CREDIT_MEMORY = 1.0, 0.2
_FORCE_NOISE = 0.02  # of the largest force: rms of what damping may make of the sensor's noise
_UNFELT = 2e-4  # N: peaks of damped noise below this need no bound
_LIGHTEST = 0.1  # kg: the filter of a loop that only observes is that of such a device
_BALL = 3.0  # standard deviations of the filtered place that it must go before work is booked: less is noise
_LONGEST_FILTER = 0.030  # s, the largest τ: work of motions faster than 1/τ is lost

# places in the state: outputs first, then what the next step needs
_ENERGY, _LOWEST, _DAMPING, _INJECTED, _LEAK, _NOISE = range(6)
_SEEN, _HEAD, _BALANCE, _STORED, _TICKS, _ALPHA = range(LEDGER, 12)
# of three numbers each: filtered place, its way in the last tick, booked place, filtered force and its sum since
_PLACE, _WAY, _BOOKED, _FORCE, _SUM = range(12, 27, 3)
_SIZE = 27


def largest_damping(mass: float, rate: float, *, delay: float = 0.0) -> float:
    """Return the largest damping (N·s/m) that the controller may add: half of m/(T + d).

    `mass` is the apparent mass of the device at its handle, kg, without the hand; `rate` is 1/T, Hz; `delay` is d, s,
    from the device's sample to its force, beyond the hold of one tick, the lag of a filter included.
    """
    if not (mass > 0.0 and rate > 0.0 and delay >= 0.0):
        raise UsageError(
            f"No damping for a mass of {mass:g} kg, {rate:g} Hz and a delay of {delay:g} s.",
            fix="Give a positive mass and rate and no negative delay.",
        )
    return float(_stable_damping(mass, 1.0 / rate, delay))


class PassivityController:
    """The energy ledger of one hand and the damping that keeps it from getting more than it gave.

    `period` is the nominal time of a tick, s; `max_force` the largest ‖F‖ that may be sent, N, which may change at any
    tick; `mass` the apparent mass of the device, kg, 0 observes only, as for a device without motors; `noise` the
    standard deviation of the device's places along one axis, m, as stated; what is measured counts where it is larger.

    `state` (27,) has all that the next step depends on besides its arguments, together with `sent` (64, 4), a ring of
    the latest forces, N, and the energy that the damping in each will take, J, and `places` (21,), differences of the
    latest places, of which the noise is measured; all may be copied and put back. `ledger` (6,) is a view of its
    outputs: E, lowest E, α, energy that damping was meant to take, `leak`, and `noise`. `delay`, s, from the device's
    sample to its force, and `stiffness`, N/m, the largest that the hand feels, 0 where it isn't known, may change at
    any tick. `added` is the energy that the body has gained by no work of the hand, in all, J; see `book`.
    """

    def __init__(self, period: float, *, max_force: float, mass: float = 0.0, noise: float = 0.0) -> None:
        if not (0.0 < period < math.inf and max_force > 0.0 and 0.0 <= mass < math.inf and noise >= 0.0):
            raise UsageError(
                f"No passivity controller for a tick of {period:g} s, {max_force:g} N, a mass of {mass:g} kg and "
                f"a noise of {noise:g} m.",
                fix="Give a positive tick and force and no negative mass or noise.",
            )
        self.period, self.max_force, self.mass = period, max_force, mass
        self.stated_noise = noise
        self.delay, self.stiffness, self.added = 0.0, 0.0, 0.0
        self.state, self.sent, self.places = np.zeros(_SIZE), np.zeros((_RING, 4)), np.zeros(NOISE_STATE)
        self.ledger = self.state[:LEDGER]
        self.apply(np.zeros(3), np.zeros(3), period)  # compile now, not in the loop
        self.state[:], self.places[:] = 0.0, 0.0

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
        """Σ (½ + d/T) |Δx̄|², m²: times the felt stiffness the most that sampling can have leaked."""
        return float(self.state[_LEAK])

    @property
    def noise(self) -> float:
        """Standard deviation of the sensor's noise along one axis, stated or measured, m."""
        return float(self.state[_NOISE])

    def apply(
        self,
        position: np.ndarray,
        force: np.ndarray,
        elapsed: float,
        *,
        stored: float = 0.0,
        clamped: bool = False,
        free: bool = False,
    ) -> None:
        """Count the way from the last position, and damp the force where the hand was given too much.

        `position` (3,) is the hand's, m; `force` (3,), N, in the same axes, what would be sent, overwritten by what
        shall be. `elapsed` s have passed since the last step. `stored` is the energy that the body holds, J, as far as
        the hand can get it back; 0 compares the ledger with zero. `clamped` says that the force limit acts, so that the
        hand doesn't put in what the body states; `free` that nothing is touched: then a credit ends.
        """
        _step(
            self.state,
            self.sent,
            self.places,
            position,
            force,
            elapsed if elapsed > 0.0 else self.period,
            self.delay / self.period,
            (self.period, self.max_force, self.mass, self.stated_noise, self.stiffness),
            stored,
            clamped,
            free,
        )

    def interrupt(self) -> None:
        """Note a tick of zero force on a hand whose way isn't known; a credit ends, a debt stays."""
        self.state[_HEAD] = (self.state[_HEAD] + 1.0) % _RING
        self.sent[int(self.state[_HEAD])] = 0.0
        self.state[_SEEN] = 0.0
        self.state[_DAMPING] = self.state[_ALPHA] = 0.0
        self.state[_ENERGY] = min(self.energy, 0.0)
        self.state[_BALANCE] = min(float(self.state[_BALANCE]), 0.0)
        forget_motion(self.places)

    def amend(self, force: np.ndarray | None = None) -> None:
        """Note that another force (3,), N, was sent than the latest step said; none was delivered by default."""
        if force is None:
            self.sent[int(self.state[_HEAD])] = 0.0
        else:
            self.sent[int(self.state[_HEAD]), :3] = force


@kernel
def _stable_damping(mass, period, delay):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """½ m/(T + d), N·s/m."""
    return _SHARE * mass / (period + delay)


@part
def _filter_time(noise, period, delay, max_force, mass, stiffness):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """The time constant τ, s, at which the bounds of the damping leave most of it."""
    if noise <= 0.0:
        return 0.0
    # ½ m/(T + d + τ) · √6 σ/(τ + T) = 2 % F: the speed filtered by τ has a noise of at most √6 σ/(τ + T)
    product = _SHARE * max(mass, _LIGHTEST) * math.sqrt(6.0) * noise / (_FORCE_NOISE * max_force)
    time = -period - 0.5 * delay + math.sqrt(0.25 * delay * delay + product)
    # and enough for the leak, K (T/2 + d), half as much again, below what the body answers to the noise
    answer = 0.5 * stiffness + _UNFELT / (6.0 * noise)
    time = max(time, 1.5 * stiffness * (0.5 * period + delay) / answer - period)
    return min(max(time, 0.0), _LONGEST_FILTER)


@part
def _damping_bound(noise, time, period, delay, max_force, mass, stiffness):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """The largest α, N·s/m, on this mass and with this noise."""
    bound = _stable_damping(mass, period, delay + time)
    if noise > 0.0:
        span = time + period
        bound = min(bound, _FORCE_NOISE * max_force * span / (math.sqrt(6.0) * noise))
        if stiffness > 0.0:
            bound = min(bound, 0.5 * stiffness * span + _UNFELT * span / (6.0 * noise))
    return bound


@part
def _observe(state, sent, position, stored, clamped, free, share, ball, elapsed, late):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Book the work of the interval that has just ended; return the square of the filtered way, m², and the balance."""
    head = int(state[_HEAD])
    whole = int(late)
    part = late - whole
    newer, older = (head - whole) % _RING, (head - whole - 1) % _RING
    ticks = state[_TICKS] + 1.0
    square, away, work = 0.0, 0.0, 0.0
    for i in range(3):
        force = (1.0 - part) * sent[newer, i] + part * sent[older, i]
        state[_FORCE + i] += share * (force - state[_FORCE + i])
        state[_SUM + i] += state[_FORCE + i]
        way = share * (position[i] - state[_PLACE + i])
        state[_PLACE + i] += way
        state[_WAY + i] = way
        square += way * way
        since = state[_PLACE + i] - state[_BOOKED + i]
        away += since * since
        work += state[_SUM + i] / ticks * since
    state[_TICKS] = ticks
    state[_LEAK] += (0.5 + late) * square
    gain = share * (stored - state[_STORED])
    state[_STORED] += gain
    balance = state[_BALANCE] - (0.0 if clamped else gain)
    balance *= 1.0 - min(1.0, elapsed / (_DEBT_MEMORY if balance < 0.0 else _CREDIT_MEMORY))
    if clamped or away >= ball * ball:
        state[_ENERGY] -= work
        balance -= 0.0 if clamped else work
        if ticks > 1.0:
            state[_LEAK] += 0.5 * away
        for i in range(3):
            state[_BOOKED + i] = state[_PLACE + i]
            state[_SUM + i] = 0.0
        state[_TICKS] = 0.0
        work = 0.0
    state[_LOWEST] = min(state[_LOWEST], state[_ENERGY])
    if free:
        state[_ENERGY] = min(state[_ENERGY], 0.0)
        balance = min(balance, 0.0)
    state[_BALANCE] = balance
    return square, balance - work


@part
def _begin(state, position, stored):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Start the filters at a place whose way nobody saw."""
    state[_STORED], state[_TICKS] = stored, 0.0
    for i in range(3):
        state[_PLACE + i] = state[_BOOKED + i] = position[i]
        state[_WAY + i] = state[_FORCE + i] = state[_SUM + i] = 0.0


@part
def _damp(state, force, debt, square, bound, payback, max_force, elapsed):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Add what pays a debt, J, to a force (3,), N; return the energy that it will take in a tick, J."""
    wanted = 0.0
    if debt > 0.0 and square > (_SLOWEST * elapsed) ** 2:
        wanted = min(bound, debt * elapsed * elapsed / (payback * square))
    alpha = state[_ALPHA] + min(1.0, elapsed / payback) * (wanted - state[_ALPHA])
    state[_ALPHA] = alpha = min(alpha, bound)
    size = math.sqrt(force[0] ** 2 + force[1] ** 2 + force[2] ** 2)
    damper = alpha * math.sqrt(square) / elapsed
    if damper > size:
        alpha *= size / damper
    for i in range(3):
        force[i] -= alpha * state[_WAY + i] / elapsed
    size = math.sqrt(force[0] ** 2 + force[1] ** 2 + force[2] ** 2)
    if size > max_force:
        for i in range(3):
            force[i] *= max_force / size
    taken = alpha * square / elapsed
    state[_DAMPING] = alpha
    state[_INJECTED] += taken
    return taken


@kernel
def _step(state, sent, places, position, force, elapsed, late, device, stored, clamped, free):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    period, max_force, mass, stated, stiffness = device
    late = min(max(late, 0.0), float(LONGEST_DELAY))
    delay = late * period
    noise = max(stated, measure_noise(places, position, elapsed))
    state[_NOISE] = noise
    time = _filter_time(noise, period, delay, max_force, mass, stiffness)
    stored = stored if math.isfinite(stored) else state[_STORED]
    square, balance = 0.0, state[_BALANCE]
    if state[_SEEN] > 0.0:
        share = period / (time + period)
        ball = _BALL * noise * math.sqrt(3.0 * share / (2.0 - share)) if time > 0.0 else 0.0
        square, balance = _observe(state, sent, position, stored, clamped, free, share, ball, elapsed, late)
    else:
        _begin(state, position, stored)
    head = int(state[_HEAD])
    for j in range(int(late)):
        balance += sent[(head - j) % _RING, 3]
    bound = _damping_bound(noise, time, period, delay, max_force, mass, stiffness)
    taken = _damp(state, force, -balance, square, bound, max(_PAYBACK, 2.0 * time), max_force, elapsed)
    head = (head + 1) % _RING
    state[_HEAD], state[_SEEN] = head, 1.0
    for i in range(3):
        sent[head, i] = force[i]
    sent[head, 3] = taken
