"""A touch surrogate corrected by what a sensor measures on a physical specimen.

prior      how a specimen may differ            touches    measured forces and their rows
belief     the filter, in square roots          corrector  the object that observes
written    belief → corrected surrogate         placing    depths at a place → positions
measures   errors before and after              correct    a whole record at once
phantom    a specimen made by formula
"""

from palpate.learning.correction.belief import Belief
from palpate.learning.correction.correct import Corrected, correct, judged
from palpate.learning.correction.corrector import Corrector, Event
from palpate.learning.correction.measures import ForceError, force_error
from palpate.learning.correction.phantom import Phantom
from palpate.learning.correction.placing import placed
from palpate.learning.correction.prior import Discrepancy
from palpate.learning.correction.touches import Noise

__all__ = [
    "Belief",
    "Corrected",
    "Corrector",
    "Discrepancy",
    "Event",
    "ForceError",
    "Noise",
    "Phantom",
    "correct",
    "force_error",
    "judged",
    "placed",
]
