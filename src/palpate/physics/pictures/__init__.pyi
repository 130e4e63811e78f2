"""Public names of `palpate.physics.pictures`, each loaded when it is first used."""

from .picture import Picture as Picture
from .plot import plot_solution as plot_solution
from .vtu import write_pvd as write_pvd
from .vtu import write_vtu as write_vtu
