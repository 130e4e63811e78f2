"""Friction: a tool that slides on the body sticks, creeps and slips, on top of the energy without friction.

Under the tool stand springs side by side, each of which enters the contact at a depth g_j of its own. At the depth s
of a contact whose normal force F_n goes with s^m, the springs carry

    normal force        F_n w_j/Σ w          w_j = (s − g_j)₊
    tangential force    |f_j| ≤ μ F_n w_j/Σ w,  and below that  ḟ_j = −k ẋ_t        k = ρ F_n/Σ w

where ẋ_t is the tool's velocity along the surface. With g_j such that w sums to s^m this is the reduced contact of
Popov & Heß (Method of Dimensionality Reduction, 2015): it gives Cattaneo 1938 and Mindlin 1949 for a ball (m = 3/2),
and Jäger 1998 and Ciavarella 1998 for other tools,

    T(x) = μ F_n [1 − (1 − x/x_s)^m]        x_s = μ s/ρ        T′(0) = ρ ∂F_n/∂s

and all histories of slip under a changing normal force, as Mindlin & Deresiewicz 1953 follow them. ρ is the tangential
over the normal stiffness, 2(1 − ν)/(2 − ν) on a half-space (Mindlin 1949).

The amplitude q of the energy and its slope tell the rest: s = (m + 1)/2 · q/|∇q|, and the outward normal is −∇q/|∇q|.
The springs are stretched along the plane across it; where that turns, they keep what lies in the new plane.

**Static and kinetic.** μ = μ_k + (μ_s − μ_k) φ, where φ is 1 at rest, falls with slip over the distance x_s and heals
in the time t_h: φ̇ = (1 − φ)/t_h − φ |slip|/x_s, the ageing law of Dieterich 1979 and Ruina 1983 with a ceiling.

**Passive.** The springs store V = Σ f²/2k. A spring that stiffens keeps its force, one that softens its stretch, one
whose limit falls is cut to it, and a spring out of contact is gone: each lowers V at a tool that stays, and what goes
is lost. While the tool moves, what slips loses |f_j| times its slip. So nothing is had back that was not put in, also
under a normal force that changes. On a straight step of any length the force at its end does at least this work.

Turning the tool about its place rubs nothing here, and the springs do not pull in the normal direction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from palpate import checks
from palpate.checks import own_arrays
from palpate.errors import UsageError
from palpate.kernels import kernel, part
from palpate.surrogates.memories.memory import Carry, Memory, MemoryState, register_memory
from palpate.surrogates.memories.patches import Patches

__all__ = ["MINDLIN", "Friction", "FrictionState", "require_coefficients"]

MINDLIN = 2.0 / 3.0  # ρ of an incompressible half-space; 1 at a Poisson's ratio of 0
SPRINGS = 32  # 0.04 % of μF_n off Cattaneo–Mindlin at the full depth, 0.8 % at 3 % of it
HEALING = 0.1  # s, t_h: friction grows within tenths of a second of rest (Dieterich 1979)
LAW_PLACE = (
    11  # place of this memory's own numbers among the arrays of an export, behind those of what is under it
)
_UNDER = ("", "relaxation", "indentation")  # by their numbers in an export


def require_coefficients(static: float, kinetic: float) -> None:
    """Refuse coefficients of friction that no pair of surfaces has: negative or no numbers, or kinetic above static."""
    for what, value in (("static", static), ("kinetic", kinetic)):
        if not (math.isfinite(value) and value >= 0):
            raise UsageError(
                f"The {what} coefficient of friction is {value:g}.",
                why="Friction only takes energy: its coefficient is a pure number from 0 on.",
                fix="Give for example 0.3 for a dry tool on silicone, 0.05 for a wet one on tissue; 0 for none.",
            )
    if kinetic > static:
        raise UsageError(
            f"The kinetic coefficient of friction, {kinetic:g}, is above the static one, {static:g}.",
            why="A contact that slides would then hold more than one that sticks.",
            fix="Give the static one as the larger of the two.",
        )


@kernel
def _is_sound(position, q, slope, dt) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Return whether a step can be taken: all numbers finite, no negative amplitude or time."""
    total = q + dt
    for a in range(3):
        total += position[a] + slope[a]
    return math.isfinite(total) and q >= 0.0 and dt >= 0.0


@part
def _norm(vector) -> float:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Return the length of a vector (3,)."""
    return math.sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2])


@part
def _contact(q, slope, force, exponent, depths):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return normal force, N, depth s and Σ w, m, of a contact; zero where there is none."""
    steep, normal_force, depth, total = _norm(slope), 0.0, 0.0, 0.0
    for a in range(3):
        normal_force -= force[a] * slope[a]
    if steep > 0.0 and normal_force > 0.0:
        depth = 0.5 * (exponent + 1.0) * q / steep
        for j in range(depths.size):
            total += max(depth - depths[j], 0.0)
    return (normal_force / steep, depth, total) if total > 0.0 else (0.0, 0.0, 0.0)


@part
def _settle(f, slope, old, k, limit):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Take a spring's force (3,) into the plane across the slope and to a new k and limit; return what is lost, J."""
    across, steep, stored = 0.0, _norm(slope), _norm(f) ** 2 / (2.0 * old)
    for a in range(3):
        across += f[a] * slope[a]
    across /= steep * steep
    for a in range(3):
        f[a] -= across * slope[a]
    size, kept = _norm(f), min(k / old, 1.0)
    if size * kept > limit:
        kept = limit / size
    for a in range(3):
        f[a] *= kept
    return stored - (size * kept) ** 2 / (2.0 * k)


@part
def _stretch(f, way, k, limit):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Move a spring's end by a way (3,) in m; return how far it slips, m."""
    for a in range(3):
        f[a] -= k * way[a]
    size = _norm(f)
    if size <= limit:
        return 0.0
    for a in range(3):
        f[a] *= limit / size
    return (size - limit) / k


@part
def _refresh(fresh, dt, slipped, law, depth) -> float:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Return φ after a time in which the contact has slipped, m; 1 without a contact."""
    if depth <= 0.0:
        return 1.0
    healed = dt / law[4]
    change = healed
    if slipped > 0.0 and law[0] > 0.0:
        change += slipped * law[2] / (law[0] * depth)
    if change <= 0.0:
        return float(fresh)
    return float(healed / change + (fresh - healed / change) * math.exp(-change))


@kernel
def _rub(position, q, slope, dt, stored, lost, force, ledger, hold, springs, law, depths, way) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Move the tool, add the springs' force to `force` (3,), N, which is that without friction, and book the step.

    `stored` and `lost`, J, are what the body itself stores then and has lost in the step; negative where it forgets,
    and the force is made here. `hold` (6,) has whether there was contact, the last place, k and φ; `law` has μ_s, μ_k,
    ρ, m and t_h; `way` (3,) is scratch.
    """
    if stored < 0.0:
        stored = 0.5 * q * q
        for a in range(3):
            force[a] = -q * slope[a]
    normal_force, depth, total = _contact(q, slope, force, law[3], depths)
    mu, old, slipped, along = law[1] + (law[0] - law[1]) * hold[5], hold[4], 0.0, 0.0
    k = law[2] * normal_force / total if total > 0.0 else 0.0
    for a in range(3):
        way[a] = position[a] - hold[1 + a] if hold[0] > 0.0 and total > 0.0 else 0.0
        along += way[a] * slope[a]
    for a in range(3):
        way[a] -= along * slope[a] / _norm(slope) ** 2 if total > 0.0 else 0.0
    heat = 0.0
    for j in range(depths.size):
        f = springs[j]
        if depth <= depths[j]:
            heat += _norm(f) ** 2 / (2.0 * old) if old > 0.0 else 0.0
            f[:] = 0.0
            continue
        limit = mu * normal_force * (depth - depths[j]) / total
        heat += _settle(f, slope, old, k, limit) if old > 0.0 else 0.0
        slip = _stretch(f, way, k, limit)
        heat += limit * slip
        slipped = slip if j == 0 else slipped  # the first spring in is the last to slip
        stored += _norm(f) ** 2 / (2.0 * k)
        for a in range(3):
            force[a] += f[a]
    lost += max(heat, 0.0)
    ledger[2] += stored - ledger[0] + lost
    ledger[0], ledger[3] = stored, lost
    ledger[1] += lost
    hold[0], hold[4], hold[5] = 1.0 if total > 0.0 else 0.0, k, _refresh(hold[5], dt, slipped, law, depth)
    for a in range(3):
        hold[1 + a] = position[a]


@register_memory
@dataclass(frozen=True, eq=False)
class Friction(Memory):
    """Friction of a tool on the surface that it presses, on top of what the body itself remembers.

    Attributes
    ----------
    static, kinetic : float
        μ_s and μ_k, pure numbers from 0 on, the kinetic one at most the static one.
    exponent : float
        m, from 1 on: the normal force goes with this power of the depth. 3/2 for a ball, 1 for a flat punch, 2 for a
        cone.
    depths : (n,)
        g_j in m, ascending: at which depths the springs enter the contact.
    ratio : float
        ρ, tangential over normal stiffness, in (0, 1].
    under : Memory, optional
        What the body itself remembers; None for a body that forgets.

    Raises
    ------
    UsageError
        For coefficients that are negative or whose order is wrong, and other numbers without a meaning.
    """

    name: ClassVar[str] = "friction"

    static: float
    kinetic: float
    exponent: float
    depths: np.ndarray
    ratio: float = MINDLIN
    under: Memory | None = None

    def __post_init__(self) -> None:
        own_arrays(self, "depths")
        require_coefficients(self.static, self.kinetic)
        checks.positive("The ratio of tangential to normal stiffness", self.ratio)
        g = self.depths
        sound = g.ndim == 1 and len(g) > 0 and np.isfinite(g).all() and bool((np.diff(g) >= 0).all())
        if not (sound and g[0] >= 0 and self.ratio <= 1 and 1 <= self.exponent < math.inf):
            raise UsageError(
                f"Friction can't have the exponent {self.exponent:g}, the ratio {self.ratio:g} and {g.size} springs.",
                why="The exponent is 1 or more, the ratio at most 1, and the springs' depths ascend from 0 on.",
                fix="Let `surrogate.with_friction(0.3)` find them from the energy.",
            )
        if self.under is not None and ("positive" not in self.under.walks or self.under.moves_rest):
            raise UsageError(
                f"A body with the memory {self.under.name!r} has no friction.",
                why="It is held, and nothing slides on it.",
                fix="Leave the friction out.",
            )

    @classmethod
    def over(
        cls,
        depth: float,
        kinetic: float,
        static: float | None = None,
        *,
        exponent: float = 1.5,
        ratio: float = MINDLIN,
        under: Memory | None = None,
    ) -> Friction:
        """Return the friction of a tool that is pressed to a depth.

        Parameters
        ----------
        depth : float
            The deepest press in m; the springs share it out.
        kinetic : float
            μ_k.
        static : float, optional
            μ_s; the kinetic one by default.
        exponent : float
            Exponent of the normal force over depth; 3/2 by default, of a ball.
        ratio : float
            Tangential over normal stiffness of the contact; by default that of an incompressible body.
        under : Memory, optional
            Memory of the body itself; none by default.

        Raises
        ------
        UsageError
            For numbers without a meaning.
        """
        checks.positive("The depth of a press with friction", depth, "m")
        share = (np.arange(SPRINGS) + 0.5) / SPRINGS
        # a flat punch has all of its springs in contact at once
        power = 1.0 / (exponent - 1.0) if exponent > 1.0 else math.inf
        return cls(
            kinetic if static is None else static, kinetic, exponent, depth * share**power, ratio, under
        )

    def __str__(self) -> str:
        both = f"{self.kinetic:g}" + (f", {self.static:g} at rest" if self.static > self.kinetic else "")
        return f"friction of {both}" + ("" if self.under is None else f"; {self.under}")

    @property
    def of_body(self) -> Memory | None:
        """The memory of the body itself, without friction."""
        return self.under

    @property
    def friction(self) -> Friction:
        """The memory itself, which is that of a tool's friction."""
        return self

    def start(self) -> FrictionState:
        """Return the state of a body that nothing touches."""
        return FrictionState(self)

    def carry_from(self, other: Memory) -> Carry:
        """Return how the springs' forces are taken over, and what the body itself remembers.

        Raises
        ------
        UsageError
            If the bodies themselves remember in ways that have nothing in common.
        """
        old = other.of_body
        below = None
        if self.under is not None and old is not None:
            below = self.under.carry_from(old)
        springs = isinstance(other, Friction) and len(other.depths) == len(self.depths)

        def carry(old: MemoryState, new: MemoryState) -> None:
            assert isinstance(new, FrictionState)
            if below is not None and old.of_body is not None and new.of_body is not None:
                below(old.of_body, new.of_body)
            if springs:
                assert isinstance(old, FrictionState)
                new.take_over(old)

        return carry

    def spread(self, patches: Patches, spacing: float) -> Friction:
        """Return the same friction on a body whose own memory is kept at places of its surface.

        Raises
        ------
        UsageError
            If the body has none, or it has no places.
        """
        if self.under is None:
            return super().spread(patches, spacing)  # type: ignore[return-value]  # which refuses
        return replace(self, under=self.under.spread(patches, spacing))

    def c_source(self) -> str | None:
        """Return the step in C99, with that of what is under it; None where that has none."""
        own = Path(__file__).with_suffix(".c").read_text("utf-8")
        if self.under is None:
            return f"#define FRICTION_UNDER(code) 0\n{own}"
        below = self.under.c_source()
        name = self.under.name.replace("-", "_")
        return None if below is None else f"{below}\n#define FRICTION_UNDER(code) {name}_step\n{own}"

    def c_arguments(self) -> tuple[np.ndarray, ...]:
        """Return the arrays of what is under it, and in the last two places the springs' depths and the law."""
        below = () if self.under is None else self.under.c_arguments()
        name = "" if self.under is None else self.under.name
        code = _UNDER.index(name) if name in _UNDER else -1
        law = np.append(self.law, code)
        room = [np.zeros(0)] * (LAW_PLACE - 1 - len(below))
        return (*below, *room, self.depths, law)

    def c_size(self) -> int:
        """Return how many numbers the state of that step has, after the four of the ledger."""
        below = 0 if self.under is None else 4 + self.under.c_size()
        return 6 + 3 * len(self.depths) + below

    @property
    def law(self) -> np.ndarray:
        """(μ_s, μ_k, ρ, m, t_h), as the kernel takes them."""
        return np.array([self.static, self.kinetic, self.ratio, self.exponent, HEALING])


class FrictionState(MemoryState):
    """The state of a body on which a tool rubs; `step` allocates nothing.

    Parameters
    ----------
    friction : Friction
        Its law.
    """

    def __init__(self, friction: Friction) -> None:
        super().__init__()
        self.friction = friction
        self.under = None if friction.under is None else friction.under.start()
        self._hold, self._springs = np.zeros(6), np.zeros((len(friction.depths), 3))
        self._way = np.zeros(3)
        self._law, self._depths = friction.law, friction.depths
        self.reset()
        self.step(np.zeros(3), 0.0, np.zeros(3), 0.0)  # compile now, not in the loop
        self.reset()

    def __repr__(self) -> str:
        return f"FrictionState: {self.friction}; force {self.force} N, stored {self.stored:.3g} J"

    @property
    def of_body(self) -> MemoryState | None:
        """The state of what the body itself remembers; None where it forgets."""
        return self.under

    def reset(self) -> None:
        """Go back to a body that nothing touches and nothing was done to."""
        super().reset()
        self._springs[:] = 0.0
        self._hold[:] = 0.0
        self._hold[5] = 1.0
        if self.under is not None:
            self.under.reset()

    def rub(self, kinetic: float) -> None:
        """Change μ_k, and μ_s in proportion, from the next step on; what is no coefficient is not heard."""
        if kinetic >= 0.0 and self.friction.kinetic > 0.0 and math.isfinite(kinetic):
            self._law[0] = self.friction.static * kinetic / self.friction.kinetic
            self._law[1] = kinetic

    def take_over(self, other: FrictionState) -> None:
        """Go on with the springs of another state of as many."""
        self._springs[:] = other._springs
        self._hold[:] = other._hold

    def step(self, position: np.ndarray, amplitude: float, slope: np.ndarray, dt: float) -> bool:
        """Move the tool to a place and renew `force`; see `MemoryState.step`."""
        self.force[:] = 0.0
        if not _is_sound(position, amplitude, slope, dt):
            return False
        stored, lost, under = -1.0, 0.0, self.under
        if under is not None:
            if not under.step(position, amplitude, slope, dt):
                return False
            self.force[:] = under.force
            stored, lost = under.stored, under.lost_in_step
        _rub(
            position, amplitude, slope, dt, stored, lost, self.force, self._ledger, self._hold, self._springs,
            self._law, self._depths, self._way,
        )  # fmt: skip
        return True
