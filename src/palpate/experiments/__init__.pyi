"""Public names of `palpate.experiments`, each loaded when it is first used."""

from .analysis import Analysis as Analysis
from .analysis import analyse as analyse
from .course import Course as Course
from .experiment_plan import Plan as Plan
from .experiment_plan import read_plan as read_plan
from .groups import Equivalence as Equivalence
from .groups import GroupMean as GroupMean
from .groups import Population as Population
from .groups import equivalence as equivalence
from .groups import group_mean as group_mean
from .groups import power_curve as power_curve
from .observers import Observer as Observer
from .placement import Adaptive as Adaptive
from .placement import Constant as Constant
from .placement import Staircase as Staircase
from .psychometric import JND as JND
from .psychometric import Answers as Answers
from .psychometric import Estimate as Estimate
from .psychometric import Goodness as Goodness
from .psychometric import Psychometric as Psychometric
from .simulation import Simulated as Simulated
from .simulation import simulate_course as simulate_course
from .stimuli import stiffened as stiffened
