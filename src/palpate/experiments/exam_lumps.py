"""A hidden lump: where it may lie, and what it adds to the energy of a pressed body in closed form.

A small sphere of volume V and modulus ρE at the depth h below a point force F on an incompressible half-space lies in
the strain-energy density W = 9 F² cos²θ/(8 π² E d⁴) (Boussinesq 1885), d from the force and θ from the normal. Over
the energy U₀ = ⅖ F s of Hertz's contact with a ball of radius R at the depth s that is, straight above,

    D/U₀ = 5 √(R s) V/(π² h⁴)        and at the distance a beside it times (1 + a²/h²)⁻³,

and the energy that the lump adds is dU = x D/(1 + β x), x = ρ − 1, β = ⅖ (Eshelby 1957: a stiff sphere in an
incompressible solid). `schematic_lumps` sets √(R s) at two thirds of the trained depth, and lets each lump be one more
unit of the network ℓ in U = U₀ exp ℓ. It says about how strong and how wide the signal is and no more: one lump at a
time, no other stiff part near, no layers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from palpate.errors import UsageError
from palpate.format import millimetres
from palpate.surrogates import Lump, Surrogate
from palpate.surrogates.baselines import require_ball

if TYPE_CHECKING:
    from palpate.runtime.touchable import Touchable

__all__ = [
    "LumpPlace",
    "added_energy_share",
    "body_with_lumps",
    "place_of",
    "require_inside",
    "schematic_lumps",
    "skin_under",
]

LEAST_COVER = 0.001  # m of tissue over a lump: thinner, it would be seen
_TYPICAL = 2.0 / 3.0  # depth of a press, over the deepest trained one, for which the signal is set
_ESHELBY = 0.4
# q at which a lump's unit g(q) is half as high, for each radial function; (1 + t)⁻³ is half as high at t = 2^⅓ − 1
_HALF = {"gaussian": math.log(2.0), "inverse-multiquadric": 3.0, "matern-5/2": 1.0828}
_HALF_WAY = math.sqrt(2.0 ** (1.0 / 3.0) - 1.0)  # a/h there
_ALONG = (
    3.0  # width of the unit along the normal, over the depth of the lump: it hardly changes with the press
)


@dataclass(frozen=True)
class LumpPlace:
    """The place of a lump under the skin."""

    above: np.ndarray  # (3,) m, the point of the skin above it
    normal: np.ndarray  # (3,) outwards there
    cover: float  # m of tissue between skin and lump; negative where it looks out


def place_of(body: Touchable, lump: Lump) -> LumpPlace:
    """Return where a lump lies under the touched surface of a body."""
    distance, normal = _above_skin(body, lump.place)
    return LumpPlace(lump.place - distance * normal, normal, -distance - lump.radius)


def skin_under(body: Touchable, place: Sequence[float]) -> tuple[float, float, float]:
    """Return the point (3,) of the skin, m, that is nearest to a place (3,), such as the centre of the probe."""
    if len(place) != 3 or not np.isfinite(place).all():
        raise UsageError("A mark needs a place.", fix="Press the body where the mark shall be.")
    distance, normal = _above_skin(body, place)
    x, y, z = (np.asarray(place) - distance * normal).tolist()
    return x, y, z


def _above_skin(body: Touchable, place: Sequence[float]) -> tuple[float, np.ndarray]:
    """Return the distance of a place (3,) from the skin, m, negative inside, and the outer normal (3,) there."""
    if body.surface is None:
        raise UsageError(
            f"{body.name} has no touched surface to hide a lump under.",
            fix="Take a body that a free probe presses.",
        )
    distance, slope, _ = body.surface.at(np.array([place], float))
    return float(distance[0]), slope[0] / np.linalg.norm(slope[0])


def body_with_lumps(surrogate: Surrogate, body: Touchable, lumps: Sequence[Lump]) -> Surrogate:
    """Return a body with hidden lumps: learnt ones where it knows any, schematic ones elsewhere.

    `body` is the surrogate as a hand finds it. With schematic lumps the posterior is left out, also where there are
    none: else the deviation of the force on the page would tell whether there are.
    """
    require_ball(body.energy.baseline, "have lumps")
    if surrogate.lumps is not None:
        return surrogate.with_lumps(lumps)
    lumped = schematic_lumps(surrogate, body, lumps)
    return lumped.with_energy(replace(lumped.hand_energy, root=None))


def require_inside(body: Touchable, lump: Lump, points: np.ndarray) -> LumpPlace:
    """Return a lump's place; refuse one that leaves the body, whose surface has the points (N, 3), m.

    It is a UsageError that less than a millimetre of tissue covers it, or another side is nearer than its radius.
    """
    at = place_of(body, lump)
    size = f"The {lump}"
    if at.cover < LEAST_COVER:
        raise UsageError(
            f"{size} leaves the skin.",
            why=f"Its top lies {_over(at.cover)}; it would be seen, and the body's own solves don't tell of it.",
            fix=f"Move it {millimetres(LEAST_COVER - at.cover)} deeper, or make it smaller.",
        )
    nearest = float(np.linalg.norm(points - np.array(lump.place), axis=1).min())
    if nearest < lump.radius:
        raise UsageError(
            f"{size} leaves the body.",
            why=f"Its surface comes within {millimetres(nearest)} of the middle of the lump.",
            fix="Move it towards the middle of the body, or make it smaller.",
        )
    return at


def _over(cover: float) -> str:
    return f"{millimetres(cover)} under the skin" if cover >= 0 else f"{millimetres(-cover)} above the skin"


def added_energy_share(lump: Lump, cover: float, radius: float, depth: float) -> float:
    """Return dU/U₀ straight above a lump under a cover (m), pressed by a ball of a radius (m) to a depth (m)."""
    x, h = lump.ratio - 1.0, cover + lump.radius
    volume = 4.0 / 3.0 * math.pi * lump.radius**3
    share = 5.0 * math.sqrt(radius * depth) * volume / (math.pi**2 * h**4)
    return max(x * share / (1.0 + _ESHELBY * x), -0.9)


def schematic_lumps(surrogate: Surrogate, body: Touchable, lumps: Sequence[Lump]) -> Surrogate:
    """Return a learnt body with lumps as units of its network; its posterior, which knows nothing of them, is left out.

    `body` is the surrogate as a hand finds it. Without lumps the surrogate is returned as it is.
    """
    if not lumps:
        return surrogate
    energy = surrogate.hand_energy
    network, depth = energy.network, _TYPICAL * body.deepest
    scaling, n = network.scaling, len(network.inputs)
    rank = max(network.factors.shape[1], n)
    factors, shifts, weights = [], [], []
    for lump in lumps:
        at = place_of(body, lump)
        h = at.cover + lump.radius
        half = math.sqrt(_HALF[network.radial]) / (_HALF_WAY * h)  # 1/m across
        along = half / (_ALONG / _HALF_WAY)
        A = half * (np.eye(3) - np.outer(at.normal, at.normal)) + along * np.outer(at.normal, at.normal)
        factor = np.zeros((rank, n))
        factor[:3, :3] = A * scaling.input_half[:3]
        centre = at.above + (body.radius - depth) * at.normal
        shift = np.zeros(rank)
        shift[:3] = A @ (centre - scaling.input_centre[:3])
        factors.append(factor)
        shifts.append(shift)
        weights.append(math.log1p(added_energy_share(lump, at.cover, body.radius, depth)))
    wide = np.zeros((network.units, rank, n))
    wide[:, : network.factors.shape[1]] = network.factors
    tall = np.zeros((network.units, rank))
    tall[:, : network.shifts.shape[1]] = network.shifts
    scaled = np.array([weights]) / scaling.output_scale[0]
    lumped = replace(
        network,
        factors=np.concatenate([wide, factors]),
        shifts=np.concatenate([tall, shifts]),
        weights=np.concatenate([network.weights, scaled], axis=1),
        extras={},
    )
    return surrogate.with_energy(replace(energy, network=lumped, root=None))
