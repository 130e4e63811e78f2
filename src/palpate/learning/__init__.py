"""How a network is learnt: one sample at a time (MRAN with an extended Kalman filter), then refined.

settings   what the filter is told           state      what it remembers
gaussian   value and derivatives             growth     when a unit is added
ekf        the update                        pruning    when a unit is removed
noise      how far a sample is believed      mran       the step: all of the above in order
learn      a fold of the step                history    what happened meanwhile
refine     variable projection               structure  how many units a refined network needs
posterior  the way back from a refined network to the filter
touch      a dataset made into a body that can be touched
"""

from palpate.learning.history import History
from palpate.learning.learn import Learned, freeze, learn
from palpate.learning.mran import Event, step
from palpate.learning.posterior import posterior
from palpate.learning.refine import Refined, refine
from palpate.learning.settings import Settings, default, founding
from palpate.learning.state import State, initial
from palpate.learning.structure import Trial, refined_network
from palpate.learning.touch import FEWEST, Refinement, hand_coordinates, learn_touch, node_outputs

__all__ = [
    "FEWEST",
    "Event",
    "History",
    "Learned",
    "Refined",
    "Refinement",
    "Settings",
    "State",
    "Trial",
    "default",
    "founding",
    "freeze",
    "hand_coordinates",
    "initial",
    "learn",
    "learn_touch",
    "node_outputs",
    "posterior",
    "refine",
    "refined_network",
    "step",
]
