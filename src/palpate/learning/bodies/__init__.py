"""A sweep of touches made into a body that can be touched and seen.

touches      what a dataset knows: probe, touched surface, symmetry, energies
images       displacements at the mirror images of the solved places
learn_body   energy and displacement, learnt and put together
"""

from palpate.learning.bodies.learn_body import TouchHistory, learn_body
from palpate.learning.bodies.touches import Touches, is_touched

__all__ = ["TouchHistory", "Touches", "is_touched", "learn_body"]
