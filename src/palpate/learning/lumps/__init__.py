"""The energy that lumps add to a pressed body, learnt from its presses without a lump.

::

    learn_lumps        the energy that any lump adds, and its error against presses solved with one
    gaussian_surfaces  sums of Gaussians of one shape, fitted to values and slopes by least squares
"""

from palpate.learning.lumps.learn_lumps import LumpPresses, learn_lumps

__all__ = ["LumpPresses", "learn_lumps"]
