"""Networks with physics around them: what a hand, an eye or a program can ask of a learnt body.

::

    touch                          a body held at one node: drag in, force out
    touch_surrogate                a body touched anywhere: one energy, its force a gradient
    laws, continuation             … how it begins at first touch, and where its learning ends
    touch_kernels, touch_trust     … the loops behind it
    surrogate_evaluator            … one touch at a time, without allocation
    touch_file                     … in a file
    field                          what the eye sees of it: displacement, stress, stretch on its surface
    surface                        how far a point is from a touched surface
    relaxation                     memory on top of an energy
"""

from palpate.surrogates.continuation import Continuation
from palpate.surrogates.fields import FieldEvaluator, FieldSurrogate, TouchedBody
from palpate.surrogates.laws import ContactLaw
from palpate.surrogates.surface import TouchedSurface
from palpate.surrogates.surrogate_evaluator import SurrogateEvaluator
from palpate.surrogates.touch import TouchEvaluator, TouchModel
from palpate.surrogates.touch_surrogate import TouchSurrogate

__all__ = [
    "ContactLaw",
    "Continuation",
    "FieldEvaluator",
    "FieldSurrogate",
    "SurrogateEvaluator",
    "TouchEvaluator",
    "TouchModel",
    "TouchSurrogate",
    "TouchedBody",
    "TouchedSurface",
]
