"""Bodies with a history: bent and stays bent, dented and keeps the dent, pushed and creeps.

elements, element_kernels    springs in parallel that slip or relax
held_body, held_evaluator    a body held at one node, one step at a time
held_file                    … in a file
dents, dent_kernels          prints on a touched surface, over any elastic energy
"""

from palpate.surrogates.plastic.dents import DentMemory, Dents
from palpate.surrogates.plastic.elements import Elements
from palpate.surrogates.plastic.held_body import HeldBody
from palpate.surrogates.plastic.held_evaluator import HeldEvaluator, HeldState

__all__ = ["DentMemory", "Dents", "Elements", "HeldBody", "HeldEvaluator", "HeldState"]
