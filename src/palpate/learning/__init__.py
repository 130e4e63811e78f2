"""Learning from datasets: networks of arrays, energies of solved bodies, streams. `palpate.rbf` has the rules.

learn        a fold of the filter's step over a data set
refinement   growth and pruning around the refinement
choosing     form, size and thresholds from the data alone
stream       learning while it runs: a learner, samples retained, bounded refinement
history      what happened meanwhile, and its picture (drawing)
measures     errors relative to the outputs' spread
touch        a dataset of beam loads made into a body that can be touched
energy       an energy of touch from solved energies, forces and stiffnesses
bodies       a dataset of touches made into a body that can be pressed anywhere
fields       how it deforms: modes that travel with the touch
grasp        a body held by a glued pad
plastic      a body that stays bent, and how it got there
correction   a learnt body bent to what a specimen answers
symmetry     isometries that a dataset tells, and how far its images reach
dispatch     `palpate.learn`: whichever fits the dataset
"""

from palpate.learning.bodies import TouchHistory, learn_body
from palpate.learning.choosing.automatic import automatic
from palpate.learning.choosing.choice import Fitted, fit
from palpate.learning.learn import Learned, freeze, learn
from palpate.learning.learning_history import History
from palpate.learning.refinement.structure import Trial, grow, prune, refined_network
from palpate.learning.stream.learner import Learner
from palpate.learning.stream.refining import Refining
from palpate.learning.stream.reservoir import Reservoir
from palpate.learning.touch import FEWEST, Refinement, hand_coordinates, learn_touch, node_outputs
from palpate.rbf.filter.observation import Observation
from palpate.rbf.filter.settings import PRESETS, Settings, default, founding, recommended
from palpate.rbf.filter.state import State, initial
from palpate.rbf.filter.step import Event, observe, step
from palpate.rbf.refinement.posterior import Posterior, posterior
from palpate.rbf.refinement.refine import Refined, refine

__all__ = [
    "FEWEST",
    "PRESETS",
    "Event",
    "Fitted",
    "History",
    "Learned",
    "Learner",
    "Observation",
    "Posterior",
    "Refined",
    "Refinement",
    "Refining",
    "Reservoir",
    "Settings",
    "State",
    "TouchHistory",
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
    "learn_body",
    "learn_touch",
    "node_outputs",
    "observe",
    "posterior",
    "prune",
    "recommended",
    "refine",
    "refined_network",
    "step",
]
