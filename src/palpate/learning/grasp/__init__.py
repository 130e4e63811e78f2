"""A grasp surrogate from energies, forces and stiffnesses of a held body.

samples       as values, slopes and curvatures of ℓ = ln(U/U₀), by displacement and by place
images        a body's symmetry, which turns place and displacement together
rest          the stiffness at rest, and the polynomial of what leaves it
learn_grasp   all of it
solves        from a dataset
"""

from palpate.learning.grasp.learn_grasp import LearntGrasp, learn_grasp
from palpate.learning.grasp.samples import GraspSamples
from palpate.learning.grasp.solves import HeldSolves

__all__ = ["GraspSamples", "HeldSolves", "LearntGrasp", "learn_grasp"]
