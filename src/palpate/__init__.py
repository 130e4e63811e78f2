"""palpate: turn a nonlinear finite-element model into something you can touch.

    physics     what the body does                sweeps      asking it many questions
    dataset     keeping the answers               network     the thing learnt, as a frozen value
    learning    how it is learnt                  surrogates  networks with physics around them
    validation  is it true                        runtime     in the hand, at 1 kHz
    viewer      in the eye                        study       the whole pipeline as one record

The names below load when they are first used, so `import palpate` costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from palpate.dataset import Dataset, Field, Layout
    from palpate.errors import PalpateError
    from palpate.learning import Fitted, Learner, Refinement, Settings, fit
    from palpate.learning import learn_dataset as learn
    from palpate.network import Network
    from palpate.physics import (
        Block,
        Body,
        BodyFamily,
        BodyForce,
        Cantilever,
        Circle,
        Cylinder,
        Dome,
        FibreFamily,
        FibreReinforced,
        GluedPad,
        Held,
        ImportedMesh,
        ImportedSolid,
        Inclusion,
        LayeredBlock,
        LinearElastic,
        LinearHardening,
        LoadAndUnload,
        MooneyRivlin,
        NeoHookean,
        Ogden,
        Organ,
        Plastic,
        PointForce,
        PointLoad,
        PrescribedDisplacement,
        Pressure,
        PreStretched,
        PronySeries,
        Rectangle,
        Section,
        SphereProbe,
        StepAndHold,
        StVenantKirchhoff,
        SurfacePatch,
        SurfaceTraction,
        TipLoad,
        Tube,
        UserMaterial,
        Varied,
        Viscoelastic,
        VoceHardening,
        Yeoh,
        named_material,
        roller,
    )
    from palpate.study import Study, TouchStudy, preset_study, read_study
    from palpate.surrogates import TouchedBody, TouchedSurface, TouchModel, TouchSurrogate
    from palpate.surrogates.grasp import GraspSurrogate
    from palpate.surrogates.loading import load
    from palpate.surrogates.plastic import HeldBody
    from palpate.sweeps import ExternalProblem, Space, local_cluster, sweep
    from palpate.units import Quantity, Range
    from palpate.validation import validate, write_report
    from palpate.viewer import serve, show

__version__ = "0.1.0"

_HOMES = {
    "Block": "physics",
    "Body": "physics",
    "BodyFamily": "physics",
    "BodyForce": "physics",
    "Cantilever": "physics",
    "Circle": "physics",
    "Cylinder": "physics",
    "Dataset": "dataset",
    "Dome": "physics",
    "ExternalProblem": "sweeps",
    "FibreFamily": "physics",
    "FibreReinforced": "physics",
    "Field": "dataset",
    "Fitted": "learning",
    "GluedPad": "physics",
    "GraspSurrogate": "surrogates.grasp",
    "Held": "physics",
    "HeldBody": "surrogates.plastic",
    "ImportedMesh": "physics",
    "ImportedSolid": "physics",
    "Inclusion": "physics",
    "LayeredBlock": "physics",
    "Layout": "dataset",
    "Learner": "learning",
    "LinearElastic": "physics",
    "LinearHardening": "physics",
    "LoadAndUnload": "physics",
    "MooneyRivlin": "physics",
    "NeoHookean": "physics",
    "Network": "network",
    "Ogden": "physics",
    "Organ": "physics",
    "PalpateError": "errors",
    "Plastic": "physics",
    "PointForce": "physics",
    "PointLoad": "physics",
    "PrescribedDisplacement": "physics",
    "Pressure": "physics",
    "PreStretched": "physics",
    "PronySeries": "physics",
    "Quantity": "units",
    "Range": "units",
    "Rectangle": "physics",
    "Refinement": "learning",
    "Section": "physics",
    "Settings": "learning",
    "Space": "sweeps",
    "SphereProbe": "physics",
    "StVenantKirchhoff": "physics",
    "StepAndHold": "physics",
    "Study": "study",
    "SurfacePatch": "physics",
    "SurfaceTraction": "physics",
    "TipLoad": "physics",
    "TouchModel": "surrogates",
    "TouchStudy": "study",
    "TouchSurrogate": "surrogates",
    "TouchedBody": "surrogates",
    "TouchedSurface": "surrogates",
    "Tube": "physics",
    "UserMaterial": "physics",
    "Varied": "physics",
    "Viscoelastic": "physics",
    "VoceHardening": "physics",
    "Yeoh": "physics",
    "fit": "learning",
    "learn": "learning:learn_dataset",
    "load": "surrogates.loading",
    "local_cluster": "sweeps",
    "named_material": "physics",
    "preset_study": "study",
    "read_study": "study",
    "roller": "physics",
    "serve": "viewer",
    "show": "viewer",
    "sweep": "sweeps",
    "validate": "validation",
    "write_report": "validation",
}

__all__ = [
    "Block",
    "Body",
    "BodyFamily",
    "BodyForce",
    "Cantilever",
    "Circle",
    "Cylinder",
    "Dataset",
    "Dome",
    "ExternalProblem",
    "FibreFamily",
    "FibreReinforced",
    "Field",
    "Fitted",
    "GluedPad",
    "GraspSurrogate",
    "Held",
    "HeldBody",
    "ImportedMesh",
    "ImportedSolid",
    "Inclusion",
    "LayeredBlock",
    "Layout",
    "Learner",
    "LinearElastic",
    "LinearHardening",
    "LoadAndUnload",
    "MooneyRivlin",
    "NeoHookean",
    "Network",
    "Ogden",
    "Organ",
    "PalpateError",
    "Plastic",
    "PointForce",
    "PointLoad",
    "PreStretched",
    "PrescribedDisplacement",
    "Pressure",
    "PronySeries",
    "Quantity",
    "Range",
    "Rectangle",
    "Refinement",
    "Section",
    "Settings",
    "Space",
    "SphereProbe",
    "StVenantKirchhoff",
    "StepAndHold",
    "Study",
    "SurfacePatch",
    "SurfaceTraction",
    "TipLoad",
    "TouchModel",
    "TouchStudy",
    "TouchSurrogate",
    "TouchedBody",
    "TouchedSurface",
    "Tube",
    "UserMaterial",
    "Varied",
    "Viscoelastic",
    "VoceHardening",
    "Yeoh",
    "fit",
    "learn",
    "load",
    "local_cluster",
    "named_material",
    "preset_study",
    "read_study",
    "roller",
    "serve",
    "show",
    "sweep",
    "validate",
    "write_report",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'palpate' has no attribute {name!r}")
    module, _, attribute = _HOMES[name].partition(":")
    value = getattr(importlib.import_module(f"palpate.{module}"), attribute or name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
