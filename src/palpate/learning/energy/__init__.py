"""The energy of a body from solved energies, forces and stiffnesses: all that is observed is of one scalar, ℓ.

energy_samples   (U, F, ∂F/∂x) as values, slopes and curvatures of ℓ, each weighted to make its error relative
energy_images    a body's symmetry, in scaled inputs
energy_problem   what the search needs of an energy: refinement, and errors of solves left out
energy_search    kinds of units, growth, random starts, and the mean of the best networks
trust            the posterior of the linear weights, calibrated by what leaving solves out has shown
suspect_solves   solves that contradict their neighbours
energy_export    the parts of an energy from what was found
learn_energy     all of it, with the choice of a baseline
"""

from palpate.learning.energy.learn_energy import learn_energy
from palpate.learning.energy.suspect_solves import SuspectSolve

__all__ = ["SuspectSolve", "learn_energy"]
