"""Fields, for the eye: modes whose coefficients are learnt, on a touched surface or of any physics.

::

    field                  Field, the contract, and which fields of a surrogate are of which kind
    field_surrogate        FieldSurrogate, the whole of it, and its errors
    depth_amplitude        how a field grows with depth
    node_field             NodeField, at the nodes of a body that loads bend
    modal_field            ModalField, of any physics: at nodes or cells of a mesh, or along an axis
    places                 the nodes, cells or points of an axis that such a field has values at
    local_mode             the part that moves with the probe, and its variation from place to place
    field_kernels          the compiled loops
    field_evaluator        one touch at a time, without allocation
    surface_interpolation  from the nodes of one mesh of a surface to those of another
"""

from palpate.surrogates.fields.depth_amplitude import DepthAmplitude
from palpate.surrogates.fields.field import Field, line_of, modal_fields, surface_fields
from palpate.surrogates.fields.field_evaluator import FieldEvaluator
from palpate.surrogates.fields.field_surrogate import FieldSurrogate
from palpate.surrogates.fields.local_mode import LocalMode, Variation
from palpate.surrogates.fields.modal_field import ModalEvaluator, ModalField
from palpate.surrogates.fields.node_field import NodeEvaluator, NodeField
from palpate.surrogates.fields.places import AxisPlaces, MeshPlaces

__all__ = [
    "AxisPlaces",
    "DepthAmplitude",
    "Field",
    "FieldEvaluator",
    "FieldSurrogate",
    "LocalMode",
    "MeshPlaces",
    "ModalEvaluator",
    "ModalField",
    "NodeEvaluator",
    "NodeField",
    "Variation",
    "line_of",
    "modal_fields",
    "surface_fields",
]
