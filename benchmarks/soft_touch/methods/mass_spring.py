"""Points and springs on the mesh of the case, in equilibrium under the ball (`benchmarks.massspring`)."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from benchmarks.massspring import MassSpringBody

from .stepped import NEAR, free_triangles, with_mesh

__all__ = ["BEST", "SETTINGS", "load"]

SETTINGS: tuple[dict[str, Any], ...] = (
    *({"pad": pad, "volume": volume} for volume in (True, False) for pad in (2e6, 1e7)),
    {"pad": 5e7, "volume": True},
    *({"pad": 1e7, "volume": True, "surface": surface} for surface in (4e-3, 3e-3)),
)
BEST: dict[str, Any] = SETTINGS[1]


class _Springs:
    solves = 0

    def __init__(self, case: Any, pad: float, volume: bool) -> None:
        mesh = case.mesh
        surfaces = {
            "free": free_triangles(mesh),
            "fixed": _triangles_within(mesh["tetrahedra"], mesh["fixed"]),
        }
        a, b, c, d = mesh["points"][mesh["tetrahedra"]].transpose(1, 0, 2)
        body = SimpleNamespace(
            points=mesh["points"],
            tetrahedra=mesh["tetrahedra"],
            volumes=np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6.0,
            regions=tuple(case.materials),
            region_of=mesh["label"],
            surfaces=tuple(surfaces),
            triangles_of=lambda name: surfaces[name],
        )
        materials = {
            name: SimpleNamespace(young=m["young"], poisson=m["poisson"], density=1000.0)
            for name, m in case.materials.items()
        }
        probe = SimpleNamespace(radius=case.radius, touches="free", pad=pad, stop=None)
        springs = MassSpringBody(body, materials, fixed="fixed", volume=volume)
        self._solver, self._near = springs.open(probe), NEAR * case.radius
        self.settings = f"pad {pad:g} N/m³, springs {'and volumes' if volume else 'alone'}"

    def force(self, places: np.ndarray) -> np.ndarray:
        """Return forces (n, 3) in equilibrium, nan where none is found."""
        forces = np.full_like(places, np.nan)
        for i, place in enumerate(places):
            centre = self._solver.centre
            if centre is None or np.linalg.norm(place - centre) > self._near:
                self._solver.reset()
            answer = self._solver.solve(place)
            if answer.converged:
                forces[i] = answer.response
            else:
                self._solver.reset()
        return forces


def _triangles_within(tetrahedra: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Return the faces (n, 3) whose three corners are all among the chosen points."""
    faces = np.concatenate([tetrahedra[:, order] for order in ([1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1])])
    return np.asarray(faces[chosen[faces].all(axis=1)])


def load(case: Any, **setting: Any) -> _Springs:
    """Return the method; `setting` is one of `SETTINGS`."""
    used = dict(setting or BEST)
    surface = used.pop("surface", None)
    method = _Springs(with_mesh(case, surface), **used)
    method.settings += f", surface {1e3 * surface:g} mm" if surface else ""
    return method
