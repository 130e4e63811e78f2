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
    from palpate.dataset import Dataset
    from palpate.errors import PalpateError
    from palpate.learning import Fitted, Learner, Refinement, Settings, fit
    from palpate.learning import learn_touch as learn
    from palpate.network import Network
    from palpate.physics import (
        Cantilever,
        Circle,
        LinearElastic,
        PointLoad,
        Rectangle,
        Section,
        TipLoad,
        named_material,
    )
    from palpate.study import Study, preset_study, read_study
    from palpate.surrogates import TouchModel
    from palpate.sweeps import Space, local_cluster, sweep
    from palpate.units import Quantity, Range
    from palpate.validation import validate, write_report
    from palpate.viewer import serve

__version__ = "0.1.0"

_HOMES = {
    "Cantilever": "physics",
    "Circle": "physics",
    "Dataset": "dataset",
    "Fitted": "learning",
    "Learner": "learning",
    "LinearElastic": "physics",
    "Network": "network",
    "PalpateError": "errors",
    "PointLoad": "physics",
    "Quantity": "units",
    "Range": "units",
    "Rectangle": "physics",
    "Refinement": "learning",
    "Section": "physics",
    "Settings": "learning",
    "Space": "sweeps",
    "Study": "study",
    "TipLoad": "physics",
    "TouchModel": "surrogates",
    "fit": "learning",
    "learn": "learning:learn_touch",
    "local_cluster": "sweeps",
    "named_material": "physics",
    "preset_study": "study",
    "read_study": "study",
    "serve": "viewer",
    "sweep": "sweeps",
    "validate": "validation",
    "write_report": "validation",
}

__all__ = [
    "Cantilever",
    "Circle",
    "Dataset",
    "Fitted",
    "Learner",
    "LinearElastic",
    "Network",
    "PalpateError",
    "PointLoad",
    "Quantity",
    "Range",
    "Rectangle",
    "Refinement",
    "Section",
    "Settings",
    "Space",
    "Study",
    "TipLoad",
    "TouchModel",
    "fit",
    "learn",
    "local_cluster",
    "named_material",
    "preset_study",
    "read_study",
    "serve",
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
