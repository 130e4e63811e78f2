"""Studies of beams that remember: held at the tip, led through histories, learnt as a `HeldBody`.

record    what such a study says        presets   the two that have a name
stages    how it is carried out
"""

from palpate.study.held.record import HeldStudy

__all__ = ["HeldStudy"]
