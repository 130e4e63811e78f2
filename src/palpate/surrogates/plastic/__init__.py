"""A rod with a memory, held at one node: bent and stays bent, or pushed and creeps.

held_body, held_evaluator    the body, one step at a time
held_file                    … in a file
"""

from palpate.surrogates.plastic.held_body import HeldBody
from palpate.surrogates.plastic.held_evaluator import HeldEvaluator, HeldState

__all__ = ["HeldBody", "HeldEvaluator", "HeldState"]
