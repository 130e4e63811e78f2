"""What a dataset of touches knows: the probe, the surface that it presses, the body's symmetry, and the energies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.dataset import Dataset, Layout
from palpate.errors import UsageError
from palpate.learning.bodies.kept_surface import touched_surface
from palpate.learning.dataset_symmetry import declared_symmetry, widen_ranges
from palpate.learning.energy.columns import columns_of
from palpate.surrogates import TouchedSurface
from palpate.units import Range

__all__ = ["FEWEST", "Touches", "is_touched"]

FEWEST = 6  # solves in contact: what the law and an affine network have to be found from, and judged by
UPRIGHT = ("x_min", "x_max", "y_min", "y_max")  # what "side" of a box means
PROBES = ("SphereProbe",)
RADIUS = "probe.radius"  # what a family calls it
DISSIPATING = ("Plastic",)
SHOULDER = (
    1 / 3
)  # of the radius: how the touched surface rolls off where it ends, as smooth in the middle as at its border


def is_touched(data: Dataset) -> bool:
    """Whether a dataset is of a body pressed by a probe, by what its provenance says."""
    return _probe(data) is not None


def _probe(data: Dataset) -> Mapping[str, Any] | None:
    acting = data.provenance.get("problem", {}).get("interactions", [])
    found = [a for a in acting if isinstance(a, Mapping) and a.get("type") in PROBES]
    return found[0] if len(found) == len(acting) == 1 else None


@dataclass(frozen=True, eq=False)
class Touches:
    """Solves of a body under a probe, and what is known of them.

    Attributes
    ----------
    data : Dataset
        Converged rows.
    radius : float
        Of the probe, m; where it is an input, the middle of its range.
    radius_input : int or None
        The input that it is.
    inputs : n ranges
        Those of the data, widened to all mirror images.
    surface : TouchedSurface
    points, triangles : (P, 3), (t, 3) arrays
        The body's whole surface, of a mesh that is fine wherever it is touched.
    matrices, about : (k, 3, 3), (3,) arrays
        The body's symmetry, the identity among it.
    resolved : float or None
        Depth at which a contact is as wide as an element, m; None for elements of the usual size.
    deepest : float
        Depth that the solves were made to, m; 0 where the provenance does not tell.
    """

    data: Dataset
    radius: float
    radius_input: int | None
    inputs: tuple[Range, ...]
    surface: TouchedSurface
    points: np.ndarray
    triangles: np.ndarray
    matrices: np.ndarray
    about: np.ndarray
    resolved: float | None
    deepest: float

    @classmethod
    def of(cls, data: Dataset, layout: Layout | None = None) -> Touches:
        """From a sweep; `layout` is of a mesh that is fine wherever the body shall be touched, by default the sweep's.

        Raises
        ------
        UsageError
            If the data is of no body under one probe, lacks energies or forces, or too few solves converged.
        """
        probe = _checked_probe(data)
        data = data.ok
        if len(data) < FEWEST:
            raise UsageError(
                f"{len(data)} converged solves are too few to learn a touched body from.",
                fix=f"Sweep at least {FEWEST}, better 40 or more.",
            )
        rest, triangles, touched = _surface(data, layout, str(probe["touches"]))
        nodes, own = np.unique(triangles, return_inverse=True)
        which, radius = _radius_input(data), float(probe["radius"])
        largest = radius if which is None else data.ranges[which].high
        radius = radius if which is None else (data.ranges[which].low + largest) / 2
        matrices, about = declared_symmetry(data)
        element = data.provenance["problem"].get("element")
        return cls(
            data,
            radius,
            which,
            (*widen_ranges(data.ranges[:3], matrices, about), *data.ranges[3:]),
            touched_surface(
                data,
                rest,
                touched,
                radius=largest,
                inner=_inner(_deepest(probe), largest),
                shoulder=SHOULDER * radius,
            ),
            rest[nodes],
            own.reshape(-1, 3),
            matrices,
            about,
            None if element is None else float(element) ** 2 / (2 * radius),
            _deepest(probe),
        )

    @property
    def columns(self) -> np.ndarray:
        """For each solve (N,) the number of its column, whatever its further inputs are."""
        return columns_of(self.data.X[:, :3], self.surface, self.radius)


def _deepest(probe: Mapping[str, Any]) -> float:
    return float(max(probe.get("depth") or (0.0,)))


def _inner(deepest: float, radius: float) -> float:
    """How deep the probe's centre may go before the distance ends, m: the probe is twice as deep there as trained."""
    return max(1.5 * radius, 2.0 * deepest - radius)


def _radius_input(data: Dataset) -> int | None:
    """Which input is the probe's radius, by what the provenance says of a family's."""
    varied = [one["path"] for one in data.provenance["problem"].get("varied", ())]
    return 3 + varied.index(RADIUS) if RADIUS in varied else None


def _checked_probe(data: Dataset) -> Mapping[str, Any]:
    probe = _probe(data)
    if probe is None:
        raise UsageError(
            "This dataset is not of a body under one probe.",
            why="Its provenance names no single SphereProbe.",
            fix="Pass what `palpate.sweep(body, probe, …)` returns; for other arrays use `palpate.fit`.",
        )
    for name in ("potential_energy", "response", "displacement"):
        if name not in data:
            raise UsageError(
                f"The dataset has no {name.replace('_', ' ')}.",
                why="A touched body is learnt from energies, forces and displacements.",
                fix="Sweep the body again with this version.",
            )
    body = data.provenance["problem"].get("body", {})
    if body.get("held") or any(body.get("gravity", ())):
        raise UsageError(
            "A touched body under constant loads can't be learnt yet.",
            why="Depth is measured to the surface at rest, which gravity and pre-stress have moved.",
            fix="Leave gravity and held interactions out.",
        )
    for region, material in body.get("material", {}).items():
        if material.get("type") in DISSIPATING:
            raise UsageError(
                f"The material of {region!r} yields, so its force has no energy.",
                fix="Take an elastic or viscoelastic one.",
            )
    return probe


def _surface(data: Dataset, layout: Layout | None, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes, all triangles, and those of the touched surface."""
    if layout is None:
        rest, triangles = data.rest, data.triangles
        surfaces, of = data["surface"].tolist(), data["surface_of"]
    else:
        assert layout.triangles is not None
        assert layout.surface_of is not None
        rest, triangles, of = layout.rest, layout.triangles, layout.surface_of
        surfaces = list(layout.surfaces)
    names = (name,) if name in surfaces else UPRIGHT if name == "side" else ()
    touched = np.isin(of, [i for i, one in enumerate(surfaces) if one in names])
    if not touched.any():
        raise UsageError(
            f"The mesh has no surface called {name!r}.", why=f"It has {', '.join(map(str, surfaces))}."
        )
    return rest, triangles, triangles[touched]
