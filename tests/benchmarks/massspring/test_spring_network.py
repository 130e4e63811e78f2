"""Spring constants against elasticity: a regular tetrahedron, and a lattice whose moduli can be summed by hand."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from benchmarks.massspring.kernels import springs_gradient, volumes_gradient
from benchmarks.massspring.springs import LLOYD
from lattice import Elastic, Sphere, kuhn_block, kuhn_points

from benchmarks.massspring import MassSpringBody, MassSpringMotion, spring_network
from palpate.errors import UsageError

REGULAR = np.array([[1, 1, 1], [-1, 1, -1], [1, -1, -1], [-1, -1, 1.0]]) * 0.01
YOUNG = 9e3


def element_stiffness(points: np.ndarray, young: float, poisson: float) -> np.ndarray:
    """Stiffness (12, 12) of the linear tetrahedron: V (λ gᵢgⱼᵀ + μ gⱼgᵢᵀ + μ gᵢ·gⱼ I)."""
    lam, mu = young * poisson / (1 + poisson) / (1 - 2 * poisson), young / 2 / (1 + poisson)
    affine = np.hstack([np.ones((4, 1)), points])
    g, volume = np.linalg.inv(affine)[1:].T, abs(np.linalg.det(affine)) / 6
    blocks = lam * np.einsum("ai,bj->aibj", g, g) + mu * np.einsum("bi,aj->aibj", g, g)
    blocks += mu * np.einsum("ak,bk,ij->aibj", g, g, np.eye(3))
    return volume * blocks.reshape(12, 12)


def springs_of_one(points: np.ndarray) -> np.ndarray:
    """Stiffness (12, 12) of six springs of 1 N/m on a tetrahedron's edges."""
    total = np.zeros((12, 12))
    for a, b in itertools.combinations(range(4), 2):
        row = np.zeros((4, 3))
        row[a] = (points[a] - points[b]) / np.linalg.norm(points[a] - points[b])
        row[b] = -row[a]
        total += np.outer(row, row)
    return total


def test_a_regular_tetrahedron_has_the_springs_that_fit_its_stiffness_best():
    fe, unit = element_stiffness(REGULAR, YOUNG, 0.25), springs_of_one(REGULAR)
    best = np.vdot(fe, unit) / np.vdot(unit, unit)
    network = spring_network(REGULAR, np.array([[0, 1, 2, 3]]), YOUNG, volume=False)
    assert network.volumes[0] > 0
    assert network.stiffness == pytest.approx(best, rel=1e-12)
    assert network.stiffness == pytest.approx(2 * np.sqrt(2) / 25 * YOUNG * network.lengths, rel=1e-12)


def energy_of(network, x: np.ndarray) -> float:
    """J."""
    n, out = network, np.zeros_like(x)
    return springs_gradient(x, n.edges, n.lengths, n.stiffness, out) + volumes_gradient(
        x, n.tetrahedra, n.volumes, n.bulk, out
    )


@pytest.mark.grid
@pytest.mark.parametrize(
    ("strain", "sum_of_directions"),
    [
        # mean over the six kinds of tetrahedra of Σ (n·ε n)² over their edges: 3 axes, 2 face diagonals, 1 diagonal
        (np.diag([1.0, 0, 0]), 1 + (2 / 3) * 2 * (1 / 4) + 1 / 9),
        (np.array([[0, 0.5, 0], [0.5, 0, 0], [0, 0, 0]]), (1 / 3) * 2 * (1 / 4) + 1 / 9),
        (np.eye(3), 6.0),
    ],
)
def test_moduli_of_a_lattice_of_cubes(strain: np.ndarray, sum_of_directions: float):
    points, tetrahedra = kuhn_points((3, 2, 2), (0.03, 0.02, 0.02))
    network = spring_network(points, tetrahedra, YOUNG, volume=False)
    size = 1e-6
    energy = energy_of(network, points + size * points @ strain)
    expected = 0.5 * LLOYD * YOUNG * network.volumes.sum() * sum_of_directions * size**2
    assert energy == pytest.approx(expected, rel=20 * size)


@pytest.mark.parametrize("poisson", [0.25, 0.3, 0.45, 0.499])
def test_the_volumes_carry_what_the_springs_lack_of_the_bulk_modulus(poisson: float):
    points, tetrahedra = kuhn_points((2, 2, 2), (0.02, 0.02, 0.02))
    network = spring_network(points, tetrahedra, YOUNG, poisson)
    size = 1e-6
    energy = energy_of(network, (1 + size) * points)
    bulk, shear = YOUNG / 3 / (1 - 2 * poisson), YOUNG / 2 / (1 + poisson)
    felt = bulk - (1 - LLOYD) * 5 / 3 * shear
    assert energy == pytest.approx(0.5 * felt * network.volumes.sum() * (3 * size) ** 2, rel=20 * size)


def test_a_body_sums_its_mass_and_mixes_materials():
    mesh = kuhn_block((2, 2, 2))
    body = MassSpringBody(mesh, Elastic(density=900.0))
    assert body.masses().sum() == pytest.approx(900.0 * 0.06 * 0.06 * 0.04)
    assert np.array_equal(body.free(), mesh.points[:, 2] > 1e-9)
    with pytest.raises(UsageError, match="lid"):
        MassSpringBody(mesh, Elastic(), fixed="lid")
    with pytest.raises(UsageError, match="'body'"):
        MassSpringBody(mesh, {"bone": Elastic()})


@pytest.mark.full
def test_a_point_that_belongs_to_nothing_stays():
    mesh = kuhn_block((2, 2, 2))
    points = np.concatenate([mesh.points, [[0.03, 0.03, 0.06]]])
    stray = dataclasses.replace(mesh, points=points)
    solver = MassSpringBody(stray, Elastic()).open(Sphere())
    answer = solver.solve((0.03, 0.03, 0.047))
    assert answer.converged
    assert not answer.displacement[-1].any()
    assert MassSpringMotion(solver).costs((0.03, 0.03, 0.047), repeats=1).explicit_longest > 0


def test_points_without_mass_are_not_marched():
    solver = MassSpringBody(kuhn_block((2, 2, 2)), Elastic(density=0.0)).open(Sphere())
    with pytest.raises(UsageError, match="density"):
        MassSpringMotion(solver)
