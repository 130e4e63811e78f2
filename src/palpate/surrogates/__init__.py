"""Surrogates, learnt of models: energy, fields and numbers that a hand, an eye or a program asks for.

::

    surrogate            energy, fields and quantities as one value, with its file
    learnt_quantities    numbers of the inputs, with deviation and trained region
    lumps                what hidden lumps add to the energy, and a body that has some
    model_card           what a file was made from, by whom, how good it is, where it ends
    energy               the energy that a hand feels: force, stiffness, trust
    baselines            what of the energy is known beforehand, one file for each kind of interaction
    contact_law          how a contact begins
    continuation         where the learning ends
    energy_kernels       the loops behind it
    energy_evaluator     one place at a time, without allocation
    field                what the eye sees of it: displacement, stress, stretch on its surface
    surface              how far a point is from a touched surface
    relaxation, plastic  memory on top of an energy
    training_record      what a body's record tells of its training, in words
    shipped_bodies       bodies that come with palpate
    moving_rest          where a body lies that a memory moves; its answer along a history
"""

from palpate.surrogates.baselines import (
    Baseline,
    ConstantBaseline,
    ContactBaseline,
    PadBaseline,
    RestStiffness,
    Solves,
    Stiffening,
    register_baseline,
)
from palpate.surrogates.contact_law import ContactLaw
from palpate.surrogates.continuation import Continuation
from palpate.surrogates.energy import LearntEnergy
from palpate.surrogates.energy_evaluator import EnergyEvaluator
from palpate.surrogates.energy_kernels import Compiled
from palpate.surrogates.fields import (
    AxisPlaces,
    Field,
    FieldEvaluator,
    FieldSurrogate,
    MeshPlaces,
    ModalEvaluator,
    ModalField,
    NodeField,
)
from palpate.surrogates.learnt_quantities import LearntQuantities
from palpate.surrogates.lumps import Lump, LumpContrast
from palpate.surrogates.surface import TouchedSurface
from palpate.surrogates.surrogate import Surrogate

__all__ = [
    "AxisPlaces",
    "Baseline",
    "Compiled",
    "ConstantBaseline",
    "ContactBaseline",
    "ContactLaw",
    "Continuation",
    "EnergyEvaluator",
    "Field",
    "FieldEvaluator",
    "FieldSurrogate",
    "LearntEnergy",
    "LearntQuantities",
    "Lump",
    "LumpContrast",
    "MeshPlaces",
    "ModalEvaluator",
    "ModalField",
    "NodeField",
    "PadBaseline",
    "RestStiffness",
    "Solves",
    "Stiffening",
    "Surrogate",
    "TouchedSurface",
    "register_baseline",
]
