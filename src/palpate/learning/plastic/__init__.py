"""Learning bodies with a history from histories.

load_histories      histories as values, and in a file
solve_histories     histories of a problem, and of the same body without its memory
drives              loads to learn from and to be judged by
learn_with_memory   a body held at one node
learn_indentation   a touched body that keeps indentations
"""

from palpate.learning.plastic.drives import held_loads, load_unload_reload, random_times, random_turns
from palpate.learning.plastic.learn_indentation import Press, learn_indentation
from palpate.learning.plastic.learn_with_memory import MemoryFit, learn_with_memory
from palpate.learning.plastic.load_histories import LoadHistories, LoadHistory, Marches, follow_loads
from palpate.learning.plastic.solve_histories import HistoryProblem, solve_elastic, solve_histories

__all__ = [
    "HistoryProblem",
    "LoadHistories",
    "LoadHistory",
    "Marches",
    "MemoryFit",
    "Press",
    "follow_loads",
    "held_loads",
    "learn_indentation",
    "learn_with_memory",
    "load_unload_reload",
    "random_times",
    "random_turns",
    "solve_elastic",
    "solve_histories",
]
