"""A pad so stiff that the tool under it counts as rigid.

On a half-space of modulus E* = E/(1 − ν²) a sphere at depth s touches within a = √(R s), under a mean pressure of
4/(3π) E* a/R (Hertz 1882). A stiff pad yields by that over k, which is a share 0.42 E*/(k a) of the depth; of the force
it takes half as much again, 0.64 E*/(k a). With k a/E* = 75 at half the largest depth that is 0.6 % of the depth and
0.9 % of the force there, and 1.3 and 1.9 % at a tenth of the largest depth. All places of a problem have the same k, so
their energies are of one function.

Of another tool a is half the lesser width of its cut at that depth. A stiff pad has no stop: nothing can be swallowed
that yields so little, and no step in depth need be short for it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from palpate.physics.interactions.interaction import Attached, Field
from palpate.physics.interactions.pressing import PressingTool
from palpate.physics.interactions.sphere import RIGID, SphereProbe
from palpate.physics.interactions.surface_tool import SurfaceTool

__all__ = ["rigid_pad", "with_rigid_pad"]

STIFF = 75.0  # k a/E* at this share of the largest depth
DEPTH = 0.5
SPREAD = 10.0  # a region counts as at most so many times stiffer than the softest: a bone deep below is not touched


def rigid_pad(probe: PressingTool, materials: Mapping[str, Any]) -> float:
    """Return the stiffness k in N/m³ of a pad that stands for a rigid tool on a body of these materials by region.

    Of several materials the stiffest counts.
    """
    moduli = [2 * m.shear_modulus / (1 - m.poisson) for m in materials.values()]
    modulus = min(max(moduli), SPREAD * min(moduli))
    depth = DEPTH * max(map(abs, probe.depth)) or probe.shape.size / 4
    return float(f"{STIFF * modulus / probe.contact_radius(depth):.3g}")


def with_rigid_pad(interaction: Any, materials: Mapping[str, Any]) -> Any:
    """Return an interaction whose pad, where it is to be rigid, has a stiffness; others stay as they are."""
    if not isinstance(interaction, PressingTool) or interaction.pad != RIGID:
        return interaction
    own: dict[str, Any] = {f.name: getattr(interaction, f.name) for f in fields(interaction)}  # type: ignore[arg-type]  # all are dataclasses
    own["pad"] = rigid_pad(interaction, materials)
    return (
        _StiffSphere(**{**own, "stop": None}) if isinstance(interaction, SphereProbe) else _StiffTool(**own)
    )


class _StiffPad(PressingTool):
    """A tool under a very stiff pad, which a solver may soften on the way."""

    def describe(self) -> dict[str, Any]:
        kind = SphereProbe if isinstance(self, SphereProbe) else SurfaceTool
        return {**super().describe(), "type": kind.__name__}

    def attach(self, field: Field) -> Attached:
        import ngsolve

        full = float(self.pad)
        pad = ngsolve.Parameter(full)
        return replace(self.attach_pad(field, pad), stiffen=lambda share: pad.Set(share * full))


@dataclass(frozen=True)
class _StiffSphere(_StiffPad, SphereProbe):
    """A rigid sphere."""


@dataclass(frozen=True)
class _StiffTool(_StiffPad, SurfaceTool):
    """A rigid tool of another shape."""

    @property
    def stop(self) -> float | None:
        return None
