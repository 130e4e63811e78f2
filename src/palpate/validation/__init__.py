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

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
