"""Experiments with people: plans, placement of stimuli, live sittings, and the statistics of what people say.

All of it was tried on simulated observers and scripted participants only.
"""

from palpate.experiments.analysis import Analysis, analyse
from palpate.experiments.course import Course
from palpate.experiments.experiment_plan import Plan, read_plan
from palpate.experiments.groups import (
    Equivalence,
    GroupMean,
    Population,
    equivalence,
    group_mean,
    power_curve,
)
from palpate.experiments.observers import Observer
from palpate.experiments.placement import Adaptive, Constant, Staircase
from palpate.experiments.psychometric import JND, Answers, Estimate, Goodness, Psychometric
from palpate.experiments.simulation import Simulated, simulate_course
from palpate.experiments.stimuli import stiffened

__all__ = [
    "JND",
    "Adaptive",
    "Analysis",
    "Answers",
    "Constant",
    "Course",
    "Equivalence",
    "Estimate",
    "Goodness",
    "GroupMean",
    "Observer",
    "Plan",
    "Population",
    "Psychometric",
    "Simulated",
    "Staircase",
    "analyse",
    "equivalence",
    "group_mean",
    "power_curve",
    "read_plan",
    "simulate_course",
    "stiffened",
]
