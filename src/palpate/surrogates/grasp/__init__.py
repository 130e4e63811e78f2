"""A body held by a glued pad: displacement in, force out, for every place of the pad.

rest         the stiffness before the pad has moved, as a symmetric root that depends on place
stiffening   how it leaves the linear spring: a polynomial
surrogate    the energy as a value
kernels      the loops behind it
evaluator    one displacement at a time, without allocation
file         in a file
"""

from palpate.surrogates.grasp.evaluator import GraspEvaluator
from palpate.surrogates.grasp.rest import RestStiffness
from palpate.surrogates.grasp.stiffening import Stiffening
from palpate.surrogates.grasp.surrogate import GraspSurrogate

__all__ = ["GraspEvaluator", "GraspSurrogate", "RestStiffness", "Stiffening"]
