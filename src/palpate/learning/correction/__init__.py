"""A surrogate of a pressed body, corrected by forces that a sensor measures on a physical specimen.

prior                how a specimen may differ from the model
touches              measured forces and their rows
specimen_posterior   the filter, in square roots
corrector            the object that observes
corrected_surrogate  posterior → corrected surrogate
probe_positions      depths at a place → positions
measures             errors before and after
load_cell            offset, drift and faults of the load cell
correct              a whole record at once
phantom              a specimen made by formula
"""

from palpate.learning.correction.correct import Correction, correct, summarise_correction
from palpate.learning.correction.corrector import Corrector, Event
from palpate.learning.correction.load_cell import LoadCell
from palpate.learning.correction.measures import force_error
from palpate.learning.correction.phantom import Phantom
from palpate.learning.correction.probe_positions import probe_positions
from palpate.learning.correction.specimen_posterior import SpecimenPosterior
from palpate.options import Discrepancy, Noise

__all__ = [
    "Correction",
    "Corrector",
    "Discrepancy",
    "Event",
    "LoadCell",
    "Noise",
    "Phantom",
    "SpecimenPosterior",
    "correct",
    "force_error",
    "probe_positions",
    "summarise_correction",
]
