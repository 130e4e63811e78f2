"""Improvement of a surrogate: the next solves are chosen where its answers are least certain.

It stands above sweeps, which solve, and learning, which learns; neither knows the other.

improve            `palpate.improve`: solve, learn and judge in turn, until an error is kept
improve_answers    the same of numbers, fields and curves; answer_choice chooses their next solves
choice_rules       how the next solves are chosen: by variance, distance or disagreement
force_model        what a Gaussian process on ln(U/U₀) expects of the force, and how its errors become errors of it
kept_solves        solves that are added batch by batch, through interruptions
stop_rule          when to stop
"""

from palpate.improvement.improve import RULES, improve
from palpate.improvement.improvement_step import ImprovementStep

__all__ = ["RULES", "ImprovementStep", "improve"]
