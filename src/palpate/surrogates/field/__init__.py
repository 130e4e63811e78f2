"""What the eye sees of a touch: fields on a body's surface, as modes whose coefficients are learnt.

::

    rise         how a field begins with depth
    dimple       the part that travels with the probe
    variation    … and how it differs from place to place
    travelling   … at any places, of many touches at once
    carrying     what is known at the nodes of one mesh, at those of another
    field        FieldSurrogate, the whole of it
    errors       what the modes miss, and what learning misses
    kernels      the loops behind it
    evaluator    one touch at a time, without allocation
    touched_body an energy and its fields together, in one file
    field_file   … how a field is kept there
"""

from palpate.surrogates.field.dimple import Dimple
from palpate.surrogates.field.errors import FieldErrors
from palpate.surrogates.field.evaluator import FieldEvaluator
from palpate.surrogates.field.field import FieldSurrogate
from palpate.surrogates.field.rise import Rise
from palpate.surrogates.field.touched_body import TouchedBody
from palpate.surrogates.field.variation import Variation

__all__ = ["Dimple", "FieldErrors", "FieldEvaluator", "FieldSurrogate", "Rise", "TouchedBody", "Variation"]
