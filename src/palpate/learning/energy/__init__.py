"""A touch surrogate from energies, forces and stiffnesses: everything observed is of one scalar, ℓ = ln(U/U₀).

samples          (U, F, ∂F/∂c) as values, slopes and curvatures of ℓ, each weighted to make its error relative
columns          which solves lie over one place
images           a body's symmetry, in scaled inputs
energy_problem   what the search needs of an energy: refinement, and errors of solves left out
energy_search    kinds of units, growth, random starts, and the mean of the best networks
laws             which contact law, and where it crosses over
trust            the posterior of the linear weights, calibrated by what leaving solves out has shown
written          what was found, as the parts of a surrogate
learn_surrogate  all of it
"""

from palpate.learning.energy.learn_surrogate import LearntSurrogate, learn_surrogate
from palpate.learning.energy.samples import EnergySamples

__all__ = ["EnergySamples", "LearntSurrogate", "learn_surrogate"]
