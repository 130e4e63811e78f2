"""Hidden lumps: what they are, the energy that they add to a learnt body, and how a body takes that energy.

::

    lump           one lump: place, radius and ratio of moduli
    gaussian_sum   a function of a few inputs as Gaussians of one shape
    lump_contrast  the learnt energy that any lump adds, by place of the hand and by lump
    lump_room      where lumps may be, and how large
    lump_units     further units of a body's network that carry the lumps which were chosen
"""

from palpate.surrogates.lumps.lump import Lump
from palpate.surrogates.lumps.lump_contrast import LumpContrast

__all__ = ["Lump", "LumpContrast"]
