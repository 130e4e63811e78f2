"""Virtual coupling: a spring between the hand and the body, where the body is stiffer than its device can bear.

The hand at x pulls a massless proxy p by a spring k. The proxy lies where body and spring balance, and the hand feels
the spring (Colgate, Stanley & Brown 1995; Adams & Hannaford 1999):

    W(x) = min over p of  U(p) + ½ k |x − p|²        F = −k (x − p)

W is an energy again, the Moreau envelope of U: the force stays a gradient, a closed path still costs nothing, and a
body that keeps or loses energy by its memory does so at the proxy. Its curvature along a direction of stiffness K is

    k K/(k + K)

so that k = L K/(K − L) makes the stiffest touch exactly as stiff as the bound L allows, and a soft one next to
unchanged. No damping acts in the spring: a sampled damper costs passivity itself (K < 2 (b − |B|)/T), and the passivity
controller adds damping when it is needed.

The proxy follows by Newton steps on the balance k (x − p) + F(p) = 0, one a tick where the body has a memory, which
must be walked once a tick, and otherwise up to three. An unfinished step costs accuracy and no safety: the force that
is sent is the spring's, which is bounded by k whatever the body is.

References
----------
J. E. Colgate, M. C. Stanley, J. M. Brown (1995), Issues in the haptic display of tool use, Proc. IROS, 140–145.
R. J. Adams, B. Hannaford (1999), Stable haptic interaction with virtual environments, IEEE Trans. Robotics and
Automation 15(3), 465–474.
J.-J. Moreau (1965), Proximité et dualité dans un espace hilbertien, Bull. Soc. Math. France 93, 273–299.
"""

from __future__ import annotations

import math

import numpy as np

from palpate.errors import UsageError
from palpate.kernels import kernel

__all__ = ["Coupling", "coupling_stiffness"]

STEPS = 3  # Newton steps a tick on a body without memory
# what may be left of the balance, as a share of the force, and in N: no hand feels less
_BALANCED, _UNFELT = 1e-3, 1e-3


def coupling_stiffness(stiffness: float, bound: float) -> float:
    """Return the spring k = L K/(K − L), N/m, that makes a body of stiffness K feel at most as stiff as `bound`, L.

    It is infinite, no spring, where K ≤ L.
    """
    if stiffness <= bound:
        return math.inf
    if not bound > 0.0:
        raise UsageError(
            "No spring makes a body soft enough for this device.",
            why=f"It may feel no stiffer than {bound:g} N/m.",
            fix="State the device's damping, raise the rate or shorten the delay.",
        )
    return bound * stiffness / (stiffness - bound) if math.isfinite(stiffness) else bound


class Coupling:
    """The spring of `stiffness` k, N/m, and its proxy, in the body's metres.

    An infinite `stiffness`, set by `change`, means that the hand touches the body itself. `hardest` is the body's
    largest, N/m, for steps where its own isn't known; `proxy` (3,), m, is where the body is touched, `force` (3,), N,
    that on the hand.
    """

    def __init__(self, stiffness: float = math.inf, hardest: float = math.inf) -> None:
        self.stiffness, self.hardest = stiffness, hardest
        self.proxy, self.force = np.zeros(3), np.zeros(3)
        self._rested = True
        _follow(self.proxy, np.zeros(3), self.force, np.zeros((3, 3)), 1.0, 1.0)
        _balanced(self.proxy, self.proxy, self.force, 1.0)
        _pull(self.proxy, self.proxy, 1.0, self.force)

    @property
    def active(self) -> bool:
        """True where the body is touched through the spring."""
        return self.stiffness < math.inf

    @property
    def energy(self) -> float:
        """Energy ½ k |x − p|² in the spring at the last pull, J."""
        x, y, z = self.force.tolist()
        return 0.5 * (x * x + y * y + z * z) / self.stiffness

    def change(self, stiffness: float) -> None:
        """Take over another spring; a stiffer one only where this one is slack, else energy would come of it."""
        if stiffness < self.stiffness or np.abs(self.force).max() < _UNFELT**2:
            self.stiffness = stiffness

    def reset(self) -> None:
        """Let go: at the next step the proxy starts at the hand."""
        self._rested = True
        self.force[:] = 0.0

    def take_up(self, hand: np.ndarray, force: np.ndarray) -> None:
        """Put a spring in front of a body that was touched without one; it pulls as the body did.

        `hand` is x (3,), m, `force` (3,), N, that of the body on the hand there.
        """
        self._rested = not force.any()
        self.force[:] = force
        self.proxy[:] = hand + force / self.stiffness

    def follow(self, hand: np.ndarray, force: np.ndarray, tangent: np.ndarray) -> None:
        """Move the proxy by one Newton step towards the hand x (3,), m; the first after `reset` leads to the hand.

        `force` (3,), N, is that of the body at the proxy as it was, `tangent` (3, 3) is ∂F/∂p there, N/m; zero where it
        isn't known.
        """
        if self._rested:
            self._rested = False
            self.proxy[:] = hand
            return
        _follow(self.proxy, hand, force, tangent, self.stiffness, self.hardest)

    def balanced(self, hand: np.ndarray, force: np.ndarray) -> bool:
        """Return whether the body's force (3,), N, holds the spring, as nearly as a hand can feel."""
        return bool(_balanced(self.proxy, hand, force, self.stiffness))

    def pull(self, hand: np.ndarray) -> np.ndarray:
        """Return the spring's force (3,) on a hand at x (3,), m, N; overwritten by the next call."""
        _pull(self.proxy, hand, self.stiffness, self.force)
        return self.force


@kernel
def _pull(proxy, hand, stiffness, force):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    for i in range(3):
        force[i] = -stiffness * (hand[i] - proxy[i])


@kernel
def _balanced(proxy, hand, force, stiffness):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    rest, size = 0.0, 0.0
    for i in range(3):
        pull = stiffness * (hand[i] - proxy[i])
        rest += (pull + force[i]) ** 2
        size += pull * pull
    return rest <= _BALANCED**2 * size + _UNFELT**2


@kernel
def _follow(proxy, hand, force, tangent, spring, hardest):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Solve (k I + H) Δp = k (x − p) + F by Cholesky, H = −∂F/∂p; without a positive H by the largest stiffness."""
    a, b, c = spring - tangent[0, 0], -tangent[1, 0], spring - tangent[1, 1]
    d, e, f = -tangent[2, 0], -tangent[2, 1], spring - tangent[2, 2]
    r0 = spring * (hand[0] - proxy[0]) + force[0]
    r1 = spring * (hand[1] - proxy[1]) + force[1]
    r2 = spring * (hand[2] - proxy[2]) + force[2]
    pushed = force[0] != 0.0 or force[1] != 0.0 or force[2] != 0.0
    unknown = pushed and tangent[0, 0] == 0.0 and tangent[1, 1] == 0.0 and tangent[2, 2] == 0.0
    floor = 1e-3 * spring
    x0, x1, x2 = 0.0, 0.0, 0.0
    solved = False
    if a > floor and not unknown:
        l10, l20 = b / a, d / a
        c1 = c - l10 * b
        e1 = e - l20 * b
        if c1 > floor:
            l21 = e1 / c1
            f2 = f - l20 * d - l21 * e1
            if f2 > floor:
                y1 = r1 - l10 * r0
                y2 = r2 - l20 * r0 - l21 * y1
                x2 = y2 / f2
                x1 = y1 / c1 - l21 * x2
                x0 = r0 / a - l10 * x1 - l20 * x2
                solved = True
    if not solved:
        x0, x1, x2 = r0 / (spring + hardest), r1 / (spring + hardest), r2 / (spring + hardest)
    proxy[0] += x0
    proxy[1] += x1
    proxy[2] += x2
