"""Fields of a body under a touch, for the eye: on a surface, modes whose coefficients are learnt.

::

    field_surrogate        FieldSurrogate, the whole of it, and its errors
    depth_amplitude        how a field grows with depth
    node_field             NodeField, at the nodes of a body that loads bend
    local_mode             the part that moves with the probe, and its variation from place to place
    field_kernels          the compiled loops
    field_evaluator        one touch at a time, without allocation
    surface_interpolation  from the nodes of one mesh of a surface to those of another
"""

from palpate.surrogates.fields.depth_amplitude import DepthAmplitude
from palpate.surrogates.fields.field_evaluator import FieldEvaluator
from palpate.surrogates.fields.field_surrogate import FieldErrors, FieldSurrogate
from palpate.surrogates.fields.local_mode import LocalMode, Variation
from palpate.surrogates.fields.node_field import NodeEvaluator, NodeField

__all__ = [
    "DepthAmplitude",
    "FieldErrors",
    "FieldEvaluator",
    "FieldSurrogate",
    "LocalMode",
    "NodeEvaluator",
    "NodeField",
    "Variation",
]
