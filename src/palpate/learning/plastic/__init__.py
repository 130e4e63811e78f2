"""Learning bodies with a history from histories.

paths        histories as values, and in a file      drives   loads to learn from and to be judged by
learn_held   a body held at one node              learn_indentation   a touched body that keeps prints
lead         histories of a problem, and of its elastic twin
"""

from palpate.learning.plastic.drives import held_loads, load_unload_reload, random_times, random_turns
from palpate.learning.plastic.lead import HeldProblem, lead_held, lead_twin
from palpate.learning.plastic.learn_held import Fit, learn_held
from palpate.learning.plastic.learn_indentation import Press, learn_indentation
from palpate.learning.plastic.paths import HeldPath, HeldPaths, Marches, follow_loads

__all__ = [
    "Fit",
    "HeldPath",
    "HeldPaths",
    "HeldProblem",
    "Marches",
    "Press",
    "follow_loads",
    "held_loads",
    "lead_held",
    "lead_twin",
    "learn_held",
    "learn_indentation",
    "load_unload_reload",
    "random_times",
    "random_turns",
]
