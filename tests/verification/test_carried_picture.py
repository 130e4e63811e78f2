"""The drawn surface of a part from a file, on coarse elements and on elements of half their size."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from palpate.dataset.carried_surface import CarriedSurface, quarter_triangles, surface_nodes
from palpate.physics import Body, ImportedSolid, NeoHookean, SphereProbe, SurfacePatch

HALF_AXES = np.array([0.045, 0.03, 0.02])  # m
PROBE = 0.008  # m, radius
COARSE, FINE = (
    0.004,
    0.002,
)  # m, elements under the ball: half its radius, as a study has them, and half of that


@pytest.fixture(scope="module")
def organ(tmp_path_factory) -> ImportedSolid:
    """An ellipsoid of 5,120 triangles, lying on its flattest side."""
    mesh = trimesh.creation.icosphere(subdivisions=4)
    mesh.vertices *= 1e3 * HALF_AXES
    path = Path(tmp_path_factory.mktemp("organ")) / "organ.stl"
    mesh.export(path)
    patches = (
        SurfacePatch("held", upper=(1.0, 1.0, -0.012)),
        SurfacePatch("top", lower=(-1.0, -1.0, 0.0)),
    )
    return ImportedSolid(path, unit="mm", patches=patches)


def pressed(organ: ImportedSolid, element: float) -> tuple[CarriedSurface, np.ndarray, float]:
    """The organ's own surface on such elements, its displacement there, and the force in N."""
    probe = SphereProbe(
        radius=PROBE, touches="top", depth=(0.0005, 0.003), over=((-0.004, -0.004), (0.004, 0.004))
    )
    problem = Body(organ, NeoHookean(young=1e4, poisson=0.45), fixed="held").problem(probe, element=element)
    solution = problem.open().solve(np.array([0.0, 0.0, HALF_AXES[2] + PROBE - 0.003]))
    assert solution.converged
    mesh, own = problem.mesh, problem.layout.drawn
    nodes, cells = surface_nodes(mesh.points, mesh.triangles, middles=True)
    used = np.unique(mesh.triangles)
    values = np.concatenate([solution.displacement[used], solution.mid_displacement])
    bound = CarriedSurface.bind(*own, nodes, cells)
    return bound, bound.carry(values, quarter_triangles(cells)), float(np.linalg.norm(solution.force))


def kinks(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Angles between the normals of neighbouring triangles, degrees."""
    return np.degrees(trimesh.Trimesh(points, triangles, process=False).face_adjacency_angles)


@pytest.mark.full
def test_the_drawn_surface_is_that_of_a_solve_twice_as_fine(organ: ImportedSolid):
    (own, coarse, force), (_, fine, exact) = pressed(organ, COARSE), pressed(organ, FINE)
    size = np.linalg.norm(fine, axis=1).max()
    error = np.linalg.norm(coarse - fine, axis=1) / size
    moved = np.linalg.norm(fine, axis=1) > 0.1 * size
    assert force == pytest.approx(exact, rel=0.01)
    assert error[moved].mean() < 0.03
    assert np.percentile(error[moved], 95) < 0.06
    assert error.max() < 0.15
    # as smooth as the finer solve's
    bends = [np.percentile(kinks(own.points + u, own.triangles), [95, 99.5]) for u in (coarse, fine)]
    assert (bends[0] < 1.25 * bends[1]).all()
