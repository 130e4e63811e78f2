"""How a network is learnt: one sample at a time (MRAN with an extended Kalman filter), then refined.

settings   what the filter is told           presets    named members of the family
forms      what a unit may look like         regressors units and tail, with all derivatives
state      what the filter remembers         covariance what it keeps of its uncertainty
model      the state's value and Jacobian    updates    what an observation changes
growth     when a unit is added              pruning    when one is removed
noise      how far a sample is believed      memory     what observations forbid
mran       the step: all of these in order   learn      a fold of the step
history    what happened meanwhile
refine     variable projection               structure  how many units a refined network needs
rows       its weighted values and slopes    projection its cost and Gauss–Newton matrix
leave_one_out  errors without fitting again  laplace    the structured posterior, for predictive variance
posterior  the way back from a refined network to the filter
online     a stream: the step, refinement on retained samples, snapshots for readers
reservoir  which samples are retained        refining   one bounded iteration on them, by nudge
gauge      a stream's scaling and modes      marquardt  the step of an iteration
touch      a dataset made into a body that can be touched
"""

from palpate.learning.history import History
from palpate.learning.laplace import Posterior
from palpate.learning.learn import Learned, freeze, learn
from palpate.learning.mran import Event, observe, step
from palpate.learning.observation import Observation
from palpate.learning.online import Learner
from palpate.learning.posterior import posterior
from palpate.learning.presets import PRESETS, default, founding, recommended
from palpate.learning.refine import Refined, refine
from palpate.learning.refining import Refining
from palpate.learning.reservoir import Reservoir
from palpate.learning.settings import Settings
from palpate.learning.state import State, initial
from palpate.learning.structure import Trial, grow, prune, refined_network
from palpate.learning.touch import FEWEST, Refinement, hand_coordinates, learn_touch, node_outputs

__all__ = [
    "FEWEST",
    "PRESETS",
    "Event",
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
    "Trial",
    "default",
    "founding",
    "freeze",
    "grow",
    "hand_coordinates",
    "initial",
    "learn",
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
