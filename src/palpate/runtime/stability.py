"""Bounds on how stiff a body may feel before the sampled loop itself starts to push, and what follows from them.

A force computed from a sample is held for a tick, and so trails the hand: the loop leaks energy in proportion
to the stiffness K and the tick T, and the device's own damping b must absorb it. With a virtual damping B and a
transport delay d from the device's sample to its force:

- passive, whatever holds the device:   K < (b − |B|)/(T/2 + d)    (Colgate & Schenkel 1997)
- stable in a still hand:               K < (b + B)/(T/2 + d)      (Gil et al. 2009)

The first is their theorem for a delayed spring. It asks, for every ω up to π/T, that

    b > T/2 · Re[(1 − e^(−jωT)) K e^(−jωd)]/(1 − cos ωT) = K T/2 · sin(ω (T/2 + d))/sin(ωT/2)

whose largest value is that at ω → 0, since sin aθ ≤ a sin θ for a ≥ 1 and θ ≤ π/2. Without a delay it is their
K < 2 (b − |B|)/T.

K is the felt stiffness in hand coordinates: the body's largest eigenvalue of −∂F/∂x over the trained range,
times the workspace scale (positions are scaled, forces are not). A body beyond the first bound is touched through a
spring (`coupling`), unless its user overrides that.

References
----------
J. E. Colgate, G. G. Schenkel (1997), Passivity of a class of sampled-data systems: application to haptic
interfaces, J. Robotic Systems 14(1), 37–47.
J. J. Gil, E. Sánchez, T. Hulin, C. Preusche, G. Hirzinger (2009), Stability boundary for haptic rendering:
influence of damping and delay, J. Computing and Information Science in Engineering 9(1), 011005.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from palpate.errors import UsageError
from palpate.runtime.coupling import coupling_stiffness

if TYPE_CHECKING:
    from palpate.devices.device import Traits

__all__ = ["FeltStiffness", "passive_stiffness", "stable_stiffness"]


def passive_stiffness(
    damping: float, rate: float, *, delay: float = 0.0, virtual_damping: float = 0.0
) -> float:
    """Return the stiffness (N/m) below which the loop is passive; Colgate & Schenkel 1997.

    `damping` is the device's own b, N·s/m, and `virtual_damping` B that the loop adds; `rate` is in Hz; `delay` is the
    time from the device's sample to its force, beyond the hold of one tick, s.
    """
    _check(damping, rate, delay)
    return max(0.0, (damping - abs(virtual_damping)) / (0.5 / rate + delay))


def stable_stiffness(
    damping: float, rate: float, *, delay: float = 0.0, virtual_damping: float = 0.0
) -> float:
    """Return the stiffness (N/m) below which a loop with a transport delay (s) is stable; Gil et al. 2009."""
    _check(damping, rate, delay)
    return max(0.0, (damping + virtual_damping) / (0.5 / rate + delay))


@dataclass(frozen=True)
class FeltStiffness:
    """The stiffness of a body in the hand and its bound, on one device, at one rate and delay."""

    body: float  # N/m, the body's largest in hand metres: `Workspace.felt(model.stiffness_max)`
    damping: float | None  # N·s/m, the device's own b; None without motors, which can't become unstable
    rate: float  # Hz, of ticks
    delay: float = 0.0  # s from the device's sample to its force, beyond the hold of one tick
    override: bool = False  # the body shall feel as stiff as it is, whatever follows from that
    stated: float = math.inf  # N/m, largest that the device's maker states; infinite where none is stated
    delay_known: bool = True  # the delay was stated or measured; an unknown one is taken for none
    controlled: bool = True  # the passivity controller may damp

    @classmethod
    def on(cls, traits: Traits, body: float, rate: float, override: bool, controlled: bool) -> FeltStiffness:
        """Return the stiffness in the hand of a body of `body` N/m on a device of these traits; see above."""
        known = traits.delay is not None or traits.stamped
        own, delay = traits.damping, traits.delay or 0.0
        return cls(body, own, rate, delay, override, traits.max_stiffness, known, controlled)

    @property
    def bound(self) -> float:
        """The largest stiffness, N/m, with which the loop is passive, or that the maker states where that is less.

        Infinite on a device without motors.
        """
        if self.damping is None:
            return math.inf
        return min(self.stated, passive_stiffness(self.damping, self.rate, delay=self.delay))

    @property
    def coupling(self) -> float:
        """The spring, N/m in hand metres, through which the body is touched; infinite for none.

        On a device without any damping that pulls a body which must not be felt at all: a spring of next to nothing.
        """
        if self.override or self.body <= self.bound:
            return math.inf
        return coupling_stiffness(self.body, max(self.bound, _NEXT_TO_NOTHING))

    @property
    def felt(self) -> float:
        """The largest stiffness that the hand feels, N/m."""
        return self.body if math.isinf(self.coupling) else min(self.body, max(self.bound, _NEXT_TO_NOTHING))

    def __str__(self) -> str:
        if self.damping is None:
            return f"stiffest touch {self.body:.0f} N/m; the device has no motors"
        delay = (
            f"a delay of {1e3 * self.delay:.3g} ms"
            if self.delay_known
            else "an unknown delay, taken for none,"
        )
        limits = (
            f"with the device's damping of {self.damping:g} N·s/m, {self.rate:.0f} Hz and {delay} the loop is passive "
            f"up to {self.bound:.0f} N/m"
        )
        if self.bound == self.stated:
            limits = f"its maker states {self.stated:.0f} N/m for the device"
        if self.body <= self.bound:
            return f"stiffest touch {self.body:.0f} N/m; {limits}"
        if self.override:
            return f"stiffest touch {self.body:.0f} N/m, as asked, although {limits}: it may hum or oscillate"
        return (
            f"stiffest touch {self.body:.0f} N/m, softened to {self.felt:.0f} N/m by a spring of "
            f"{self.coupling:.0f} N/m: {limits}"
        )

    @property
    def warning(self) -> str | None:
        """The sentences on what may be felt wrongly: a body that is too stiff, an unknown delay, no controller.

        None where there is nothing to warn of.
        """
        if self.damping is None:
            return None
        return " ".join([*([f"{self}."] if self.body > self.bound else []), *self.cautions]) or None

    @property
    def cautions(self) -> tuple[str, ...]:
        """Sentences on what no stiffness shows: a delay that nobody knows, and a controller that is off."""
        if self.damping is None:
            return ()
        unknown = () if self.delay_known else (_UNKNOWN_DELAY,)
        return unknown if self.controlled else (*unknown, _UNCONTROLLED)


_NEXT_TO_NOTHING = 1.0  # N/m
_UNKNOWN_DELAY = "The delay of the device is unknown: its samples bear no time, and a long one makes it hum."
_UNCONTROLLED = "The passivity controller is off: nothing damps a force that gives the hand energy."


def _check(damping: float, rate: float, delay: float) -> None:
    if not (rate > 0.0 and damping >= 0.0 and delay >= 0.0):
        raise UsageError(
            f"No bound for a damping of {damping:g} N·s/m, {rate:g} Hz and a delay of {delay:g} s.",
            fix="Give a positive rate and no negative damping or delay.",
        )
