"""Examinations by hand and experiments with people: psychometrics, placement, live sittings, scores.

All of it was tried on simulated observers and scripted participants only.

::

    append_record      events in a file that is only ever appended to
    exam_lumps         a hidden lump, what it adds to the energy of a pressed body, and where it may lie
    exam_kinds         kinds of examination: what is hidden, and what the examiner is told
    exam_folders       examinations on this machine: one folder each, never replaced
    examination        one examination while it is taken: marks, time, interruptions
    exam_touch         what was pressed: presses, depths over the surface, order of search
    exam_practice      practice: each mark is answered at once
    exam_score         what was found and missed, false alarms, area, force and time
    exam_report        the score as a page with a map of the body
    exam_page          the page on which a person examines
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
