"""A touch surrogate from energies, forces and stiffnesses: everything observed is of one scalar, ℓ = ln(U/U₀).

samples          (U, F, ∂F/∂c) as values, slopes and curvatures of ℓ, each weighted to make its error relative
columns          which solves lie over one place
images           a body's symmetry, in scaled inputs
search           starts, growth and choice by the leave-one-solve-out error
strategy         in which order it goes
laws             which contact law, and where it crosses over
trust            the posterior of the linear weights, calibrated by what leaving solves out has shown
written          what was found, as the parts of a surrogate
learn_surrogate  all of it
"""

from palpate.learning.energy.learn_surrogate import LearntSurrogate, learn_surrogate
from palpate.learning.energy.samples import EnergySamples
from palpate.learning.energy.search import EnergyTrial

__all__ = ["EnergySamples", "EnergyTrial", "LearntSurrogate", "learn_surrogate"]
