"""Finding a minimum of an energy, whatever body it belongs to.

newton  one equilibrium by Newton's method with a line search
path    a path of equilibria from load to load, in steps that adapt themselves
stop    why a search ended
"""

from palpate.physics.equilibrium.newton import Equilibrium, Model, minimise
from palpate.physics.equilibrium.path import LoadPath, follow
from palpate.physics.equilibrium.stop import Stop

__all__ = ["Equilibrium", "LoadPath", "Model", "Stop", "follow", "minimise"]
