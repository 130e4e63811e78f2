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

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
