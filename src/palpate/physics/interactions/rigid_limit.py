"""A pad so stiff that the sphere under it counts as rigid.

On a half-space of modulus E* = E/(1 − ν²) a sphere at depth s touches within a = √(R s), under a mean pressure of
4/(3π) E* a/R (Hertz 1882). A stiff pad yields by that over k, which is a share 0.42 E*/(k a) of the depth; of the force
it takes half as much again, 0.64 E*/(k a). With k a/E* = 75 at half the largest depth that is 0.6 % of the depth and
0.9 % of the force there, and 1.3 and 1.9 % at a tenth of the largest depth. All places of a problem have the same k, so
their energies are of one function.

A stiff pad has no stop: nothing can be swallowed that yields so little, and no step in depth need be short for it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from palpate.physics.interactions.interaction import Attached, Field
from palpate.physics.interactions.sphere import RIGID, SphereProbe

__all__ = ["rigid_pad", "with_rigid_pad"]

STIFF = 75.0  # k a/E* at this share of the largest depth
DEPTH = 0.5
SPREAD = 10.0  # a region counts as at most so many times stiffer than the softest: a bone deep below is not touched


def rigid_pad(probe: SphereProbe, materials: Mapping[str, Any]) -> float:
    """Return the stiffness k in N/m³ of a pad that stands for a rigid sphere on a body of these materials by region.

    Of several materials the stiffest counts.
    """
    moduli = [2 * m.shear_modulus / (1 - m.poisson) for m in materials.values()]
    modulus = min(max(moduli), SPREAD * min(moduli))
    depth = DEPTH * max(map(abs, probe.depth)) or probe.radius / 4
    contact = math.sqrt(probe.radius * min(depth, probe.radius))
    return float(f"{STIFF * modulus / contact:.3g}")


def with_rigid_pad(interaction: Any, materials: Mapping[str, Any]) -> Any:
    """Return an interaction whose pad, where it is to be rigid, has a stiffness; others stay as they are."""
    if not isinstance(interaction, SphereProbe) or interaction.pad != RIGID:
        return interaction
    pad = rigid_pad(interaction, materials)
    own = {f.name: getattr(interaction, f.name) for f in fields(interaction)}
    return _StiffSphere(**{**own, "pad": pad, "stop": None})


@dataclass(frozen=True)
class _StiffSphere(SphereProbe):
    """A sphere under a very stiff pad, which a solver may soften on the way."""

    def describe(self) -> dict[str, Any]:
        return {**super().describe(), "type": "SphereProbe"}

    def attach(self, field: Field) -> Attached:
        import ngsolve

        full = float(self.pad)
        pad = ngsolve.Parameter(full)
        return replace(self.attach_pad(field, pad), stiffen=lambda share: pad.Set(share * full))
