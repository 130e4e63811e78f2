"""The lowest natural frequency of a body: it limits how quickly a body with static answers may be pressed.

The frequency f₀ is that of small vibrations about rest, K v = (2π f₀)² M v, by Lanczos' method on K⁻¹ M. A body that is
driven at a frequency f answers, in its lowest mode, by 1/(1 − (f/f₀)²) of what it does at rest (see
`palpate.surrogates.motion`).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from palpate.physics.solid.solid_problem import SolidProblem

__all__ = ["DENSITY", "natural_frequency"]

DENSITY = (
    1000.0  # kg/m³ of a material that states none: water's, and within a tenth that of soft tissue and rubber
)
TRUE = 1e-5  # relative error of the eigenvalue


def natural_frequency(problem: SolidProblem) -> float | None:
    """Return the lowest natural frequency in Hz of a problem's body, without what acts on it; None if it is not fixed.

    Materials that relax are as stiff as in an instant, and those without a density have that of water.
    """
    import ngsolve
    from scipy.sparse.linalg import LinearOperator, eigsh

    from palpate.physics.solid.solid_model import INSTANT, BodyElements
    from palpate.physics.solid.solid_system import sparse_solver

    if not problem.body.fixed:
        return None
    elements = BodyElements(problem, sparse_solver(), 1e-9)
    field = elements.field
    elements.time_step.Set(INSTANT)
    for history in elements.histories.values():
        history.begin()
    system = elements.system(elements.energies, field.free)
    system.factorise(np.zeros(field.size))
    densities = {region: material.density or DENSITY for region, material in problem.body.materials.items()}
    trial, test = field.space.TnT()
    if problem.body.mixed_regions:
        trial, test = trial[0], test[0]
    mass = ngsolve.BilinearForm(field.space, symmetric=True)
    mass += field.mesh.MaterialCF(densities) * ngsolve.InnerProduct(trial, test) * ngsolve.dx
    mass.Assemble()
    vector, image = (field.state.vec.CreateVector() for _ in range(2))

    def times_mass(values: Any) -> np.ndarray:
        vector.FV().NumPy()[:] = np.ravel(values)
        image.data = mass.mat * vector
        return np.asarray(np.array(image.FV().NumPy()) * system.free)

    shape = (field.size, field.size)
    start = np.random.default_rng(0).standard_normal(field.size) * system.free * field.moving
    square = eigsh(
        LinearOperator(shape, matvec=times_mass, dtype=float),  # in this mode only its size counts
        M=LinearOperator(shape, matvec=times_mass, dtype=float),
        k=1,
        sigma=0.0,
        OPinv=LinearOperator(shape, matvec=lambda values: system.solve(np.ravel(values)), dtype=float),
        v0=start,
        tol=TRUE,
        return_eigenvectors=False,
    )
    return math.sqrt(float(square[0])) / (2 * math.pi)
