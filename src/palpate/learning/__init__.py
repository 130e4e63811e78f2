"""Learning from datasets: networks of arrays, energies of solved bodies, streams. `palpate.rbf` has the rules.

learn        a fold of the filter's step over a data set
search       the search for a network's structure, on which stand arrays, energy, fields and structure
pool         processes that search; ensemble, folds, starts and kernel_layer are the search's other parts
structure    growth and pruning around the refinement
arrays       a network from samples alone
stream       learning while it runs: a learner, samples retained, bounded refinement
bent_body    a dataset of loads and deflections made into a body that a hand holds at one node
energy       the energy of a body from solved energies, forces and stiffnesses
pressed_solves, pad_solves   what a dataset knows of a body that a probe presses, or a pad holds
gradient_process   a Gaussian process of a scalar that is observed with its gradient
pad_fit      the baseline of a body that is held by a pad
fields       how it deforms: modes that travel with the touch
plastic      a body that stays bent, and how it got there
correction   a learnt body bent to what a specimen answers
symmetry     isometries that a dataset tells, and how far its images reach
learn_dataset  `palpate.learn`: a dataset made into a body that is felt and seen
"""

from palpate.learning.arrays.fit import fit
from palpate.learning.arrays.fitted import Fitted
from palpate.learning.bent_body import FEWEST, hand_coordinates, node_outputs
from palpate.learning.energy import SuspectSolve, learn_energy
from palpate.learning.learn import Learned, automatic, freeze, learn
from palpate.learning.learn_dataset import LearningHistory
from palpate.learning.learn_dataset import learn as learn_dataset
from palpate.learning.learning_history import History
from palpate.learning.search import Trial
from palpate.learning.stream.following import Following
from palpate.learning.stream.learner import Learner
from palpate.learning.stream.refining import Refining
from palpate.learning.stream.reservoir import Reservoir
from palpate.learning.structure import grow, refined_network
from palpate.options import Refinement
from palpate.rbf.filter.observation import Observation
from palpate.rbf.filter.settings import PRESETS, Settings, default, founding, recommended
from palpate.rbf.filter.state import State, initial
from palpate.rbf.filter.step import Event, observe, step
from palpate.rbf.refinement.posterior import Posterior, posterior
from palpate.rbf.refinement.refine import refine

__all__ = [
    "FEWEST",
    "PRESETS",
    "Event",
    "Fitted",
    "Following",
    "History",
    "Learned",
    "Learner",
    "LearningHistory",
    "Observation",
    "Posterior",
    "Refinement",
    "Refining",
    "Reservoir",
    "Settings",
    "State",
    "SuspectSolve",
    "Trial",
    "automatic",
    "default",
    "fit",
    "founding",
    "freeze",
    "grow",
    "hand_coordinates",
    "initial",
    "learn",
    "learn_dataset",
    "learn_energy",
    "node_outputs",
    "observe",
    "posterior",
    "recommended",
    "refine",
    "refined_network",
    "step",
]
