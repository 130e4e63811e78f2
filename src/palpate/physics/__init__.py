"""The body under load: shapes, materials, what acts on it, and the solve.

    shapes        shapes and their meshes, made or imported
    materials     what a body is made of, as energies
    interactions  what acts on it, as energies with inputs
    solid         solid bodies in three dimensions
    beam          plane cantilevers
    deformed      a solved body as it is shown: nodes, cells, fields, probe
    renderer      drawing it        vtu  files of it for ParaView
    stop          why a search for an equilibrium ended
    advice        warnings of models that are hardly meant

A body and what acts on it make a problem, a plain value. The problem's `open` builds the finite elements and gives a
solver, whose `solve` returns a solution, a plain value also where there is no equilibrium.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
