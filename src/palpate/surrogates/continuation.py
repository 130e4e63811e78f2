"""The learnt factor beyond its training: where ℓ is asked once the hand leaves what was trained.

ℓ is taken at x̃(x) instead of x: at x itself inside, and in the end at a fixed point outside. Every coordinate
saturates by one function, exact below an edge e and never beyond e + w:

    σ(t) = t                            t ≤ e
    σ(t) = e + w tanh((t − e)/w)        t > e         σ' = 1 − tanh², σ'' = −2 tanh σ'/w

Value, slope and curvature meet at the edge, so x̃ is twice continuously differentiable; the energy
U₀(s(c)) exp ℓ(x̃(c)) stays one function, its force a gradient and its stiffness continuous.

First depth, which on a curved body is no coordinate: with d the distance, s = R − d and the deepest trained s*,

    c̃ = c + (s − σ(s)) ∇d          the point at the saturated depth above c

then each input by its own range. Depths saturate at a quarter beyond the deepest, positions at a quarter of the
shortest of the three ranges, further inputs at a quarter of their own, each unless told otherwise.

tanh and not a polynomial that ends: where ℓ grows with depth by e per metre, bending it down takes e σ'' from the
stiffness, and σ'' here is never large where σ' is gone. Along the depth, with U₀ of local power p,

    U''/U = p(p − 1)/s² + 2 p e σ'/s + e² σ'² + e σ''

stays positive with w = s*/4 for e s* up to 3.6 at p = 5/2, up to 1.2 at p = 2 and up to 12 and more at p = 3 (where
ℓ itself is not curved). Far out ℓ is constant and the stiffness along the depth is that of U₀, times κ.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.checks import own_arrays
from palpate.errors import UsageError
from palpate.kernels import part
from palpate.units import Range

__all__ = ["Continuation", "saturated"]

_SHARE = 0.25  # part of a range or of the deepest depth, to which ℓ is followed beyond it


@dataclass(frozen=True, eq=False)
class Continuation:
    """The ways over which the learnt factor is followed beyond its training.

    Attributes
    ----------
    widths : (n,)
        w of each input, in its unit.
    deepest : float
        s*, the deepest trained depth, m; infinite where the ranges of the inputs alone decide.
    depth_width : float
        w of the depth, m.

    Raises
    ------
    UsageError
        If one of them is not positive, or a width is not finite.
    """

    widths: np.ndarray
    deepest: float = math.inf
    depth_width: float = 1.0

    def __post_init__(self) -> None:
        own_arrays(self, "widths")
        widths = self.widths
        finite = np.isfinite(widths).all() and math.isfinite(self.depth_width)
        if not (
            widths.ndim == 1 and finite and (widths > 0).all() and self.deepest > 0 and self.depth_width > 0
        ):
            raise UsageError(
                f"Widths {self.widths} about ranges and {self.depth_width} m beyond a depth of {self.deepest} m "
                "continue nothing.",
                why="The learnt factor is followed over a positive width and then held.",
                fix="Take Continuation.of(inputs, deepest=…).",
            )

    @classmethod
    def of(
        cls, inputs: Sequence[Range], *, deepest: float = math.inf, share: float = _SHARE, felt: int = 3
    ) -> Continuation:
        """Return a `share` of each range; of the shortest of the `felt` first ones for those; of the deepest depth.

        Raises
        ------
        UsageError
            If the share or the deepest depth is not positive.
        """
        spans = np.array([r.high - r.low for r in inputs])
        spans[:felt] = spans[:felt].min()
        return cls(share * spans, deepest, share * deepest if math.isfinite(deepest) else 1.0)


@part
def saturated(t, edge, width) -> tuple[float, float, float]:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """σ, σ' and σ'' at t, for the upper edge of a range."""
    if t <= edge:
        return t, 1.0, 0.0
    h = math.tanh((t - edge) / width)
    slope = (1.0 - h) * (1.0 + h)
    return edge + width * h, slope, -2.0 * h * slope / width
