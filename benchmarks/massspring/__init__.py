"""The classical real-time rival: a body of points and springs made from the same tetrahedra.

    springs   the network: a spring per edge, its stiffness from Young's modulus and the mesh
    kernels   energy, gradient and Hessian times a vector of springs and volumes, compiled
    pad       the sphere's pad, felt by the points of the touched surface
    body      `MassSpringBody`: the value a user writes
    state     energy, gradient and Hessian of the network with a probe in it; SciPy's conjugate gradients
    solver    quasi-static answers to a probe by Newton's method
    marching  steps in time, explicit and implicit, and what they cost

Spring networks are fast and simple, and no approximation of a given elastic law that a finer mesh would improve:
docs/method/mass-spring.md says how far off they are.
"""

from benchmarks.massspring.body import MassSpringBody
from benchmarks.massspring.marching import MassSpringMotion, StepCosts
from benchmarks.massspring.solver import MassSpringSolution, MassSpringSolver
from benchmarks.massspring.springs import SpringNetwork, spring_network

__all__ = [
    "MassSpringBody",
    "MassSpringMotion",
    "MassSpringSolution",
    "MassSpringSolver",
    "SpringNetwork",
    "StepCosts",
    "spring_network",
]
