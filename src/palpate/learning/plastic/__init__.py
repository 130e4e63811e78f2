"""Learning bodies with a history.

learn_with_memory   a body held at one node, from a dataset of load histories
learn_indentation   a touched body that keeps indentations
"""

from palpate.learning.plastic.learn_indentation import Press, learn_indentation
from palpate.learning.plastic.learn_with_memory import MemoryFit

__all__ = ["MemoryFit", "Press", "learn_indentation"]
