"""The classical real-time rival: a body of points and springs made from the same tetrahedra.

    springs   the network: a spring per edge, its stiffness from Young's modulus and the mesh
    kernels   energy, gradient and Hessian times a vector of springs and volumes, compiled
    pad       the sphere's pad, felt by the points of the touched surface
    body      `MassSpringBody`: the value a user writes
    solver    quasi-static answers to a probe: Newton's method with conjugate gradients
    marching  steps in time, explicit and implicit, and what they cost

Spring networks are fast and simple, and no approximation of a given elastic law that a finer mesh would improve:
docs/method/mass-spring.md says how far off they are.
"""

from palpate.physics.massspring.body import MassSpringBody
from palpate.physics.massspring.marching import MassSpringMotion, StepCosts
from palpate.physics.massspring.solver import MassSpringSolution, MassSpringSolver
from palpate.physics.massspring.springs import SpringNetwork, spring_network

__all__ = [
    "MassSpringBody",
    "MassSpringMotion",
    "MassSpringSolution",
    "MassSpringSolver",
    "SpringNetwork",
    "StepCosts",
    "spring_network",
]
