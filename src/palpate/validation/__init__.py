"""Is it true: a model against solves it has never seen, and the report that says so.

    limits     what is asked, and why a person would notice       words     figures as a person reads them
    region     the outer part of the range; where the worst is    outputs   errors of nodal displacements
    field      errors of the whole deflected shape                force     errors of the force on the hand
    stiffness  ∂F/∂x against the finite-element curve             loops     work around closed paths
    judge      figures against limits                             judgement what every model's result can do
    result     of a body held at one node                         surrogate of a body touched anywhere
    solves     what a touched body is judged by                   dispatch  `validate`
    strokes    smoothness of the force at 1 kHz                   coverage  does the interval hold what it says
    quadrature work around closed paths, converged                mesh_error the mesh's error apart
    parts      shallow, deep, edge, worst cases                   held     of a held body that remembers
    report/    one self-contained page with figures and tables

Names are loaded when they are first used: Matplotlib and Jinja2 cost time that only a report needs.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from palpate.validation.dispatch import validate
    from palpate.validation.held import HeldLimits, HeldValidation, validate_held
    from palpate.validation.limits import Check, Limits
    from palpate.validation.report import Chapter, HeldChapter, SurrogateChapter, write_report
    from palpate.validation.result import Validation
    from palpate.validation.solves import TouchFunction, TouchSolves
    from palpate.validation.surrogate import SurrogateValidation

__all__ = [
    "Chapter",
    "Check",
    "HeldChapter",
    "HeldLimits",
    "HeldValidation",
    "Limits",
    "SurrogateChapter",
    "SurrogateValidation",
    "TouchFunction",
    "TouchSolves",
    "Validation",
    "validate",
    "validate_held",
    "write_report",
]

_HOMES = {
    "Check": "limits",
    "Limits": "limits",
    "Chapter": "report",
    "HeldChapter": "report",
    "HeldLimits": "held",
    "HeldValidation": "held",
    "SurrogateChapter": "report",
    "SurrogateValidation": "surrogate",
    "TouchFunction": "solves",
    "TouchSolves": "solves",
    "write_report": "report",
    "Validation": "result",
    "validate": "dispatch",
    "validate_held": "held",
}


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
