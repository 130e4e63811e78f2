"""Pictures of a solved body, and files that ParaView opens.

    plot      `plot_solution`: one picture of one solution
    picture   what it returns: saved as PNG, shown by a notebook or in a window
    fine      elements of second order in smaller straight ones
    fields    the quantities that colour a body, at its nodes
    scales    multiples of units that read well
    skin      the surface to draw: smooth normals, and what a cutting plane leaves
    lines     outlines, and which part of a line the body hides
    camera    from metres to pixels
    raster    triangles to pixels, with a depth buffer
    vtu       `write_vtu`, `write_pvd`

The renderer is this package's own and draws with the processor: it needs neither a display nor a graphics library,
so a picture comes out on any machine, a server in a container included. docs/guide/pictures.md says why.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from palpate.physics.pictures.picture import Picture
    from palpate.physics.pictures.plot import plot_solution
    from palpate.physics.pictures.vtu import write_pvd, write_vtu

__all__ = ["Picture", "plot_solution", "write_pvd", "write_vtu"]

_HOMES = {"Picture": "picture", "plot_solution": "plot", "write_pvd": "vtu", "write_vtu": "vtu"}


def __getattr__(name: str) -> Any:
    # lazy: the renderer's kernels load only for those who draw
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
