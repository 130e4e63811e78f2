"""Solids from STEP files, with the names that their faces and solids carry."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.physics.geometry.checks import plain_name, require_size
from palpate.physics.geometry.segments import SurfacePatch, patched

__all__ = ["INTERFACE", "read_step"]

INTERFACE = "between regions"
MILLIMETRE = 1e-3  # the CAD kernel turns every unit that a STEP file states into mm


def read_step(path: str, patches: tuple[SurfacePatch, ...]) -> Any:
    """The solids of a STEP file, glued where they touch.

    A face is called by its name, else by its colour (``colour ff0000``), else ``face 1``, ``face 2``, … in the
    order of the file; a solid by its name, else ``body``, or ``body 1``, ``body 2``, … where there are several.

    Parameters
    ----------
    path : str
    patches : tuple of SurfacePatch
        Names for the faces whose centres they contain.

    Returns
    -------
    netgen.occ.TopoDS_Shape
        In m.

    Raises
    ------
    FileFormatError
        If the file is no STEP file.
    UsageError
        If it holds no closed solid, or its size tells of mistaken units.
    """
    shape = _loaded(path)
    solids = list(shape.solids)
    if not solids:
        raise _open(path, shape)
    for number, solid in enumerate(solids):
        _name_faces(solid)
        name = plain_name(solid.name) if solid.name else "body" if len(solids) == 1 else f"body {number + 1}"
        solid.mat(name)
    body = _in_metres(solids)
    low, high = body.bounding_box
    require_size(path, max(high[i] - low[i] for i in range(3)), "stated in the file")
    _name_interfaces(body)
    _apply(patches, body)
    return body


def _loaded(path: str) -> Any:
    from netgen.meshing import NgException
    from netgen.occ import OCCException, OCCGeometry

    try:
        return OCCGeometry(path).shape
    except (NgException, OCCException, RuntimeError) as error:
        raise FileFormatError(
            f"The file {path} can't be read as STEP.",
            why=f"It is corrupt, cut short or of another format ({str(error).strip()}).",
            fix="Open it in the CAD program and export it again as STEP AP214 or AP242.",
        ) from error


def _open(path: str, shape: Any) -> UsageError:
    places = [tuple(round(v, 7) for v in edge.center) for face in shape.faces for edge in face.edges]
    lone = [place for place, count in Counter(places).items() if count == 1]
    if not places:
        return FileFormatError(
            f"The file {path} holds no shape.",
            why="The CAD kernel found neither solids nor faces in it: it is empty, cut short or damaged.",
            fix="Open it in the CAD program and export the solid again.",
        )
    where = f" around ({', '.join(f'{v * MILLIMETRE:.4g}' for v in np.mean(lone, axis=0))}) m" if lone else ""
    return UsageError(
        f"{path} holds no solid: its surface is open, {len(lone)} edges belong to one face only.",
        why=f"There is a hole{where}, or the faces were not sewn into a solid.",
        fix="Close and sew the faces in the CAD program, and export a solid.",
    )


def _name_faces(solid: Any) -> None:
    for number, face in enumerate(solid.faces):
        if face.name:
            face.name = plain_name(face.name)
        elif face.col is not None:
            red, green, blue = (round(255 * v) for v in tuple(face.col)[:3])
            face.name = f"colour {red:02x}{green:02x}{blue:02x}"
        else:
            face.name = f"face {number + 1}"


def _in_metres(solids: list[Any]) -> Any:
    from netgen.occ import Glue, Pnt

    scaled = []
    for solid in solids:
        small = solid.Scale(Pnt(0, 0, 0), MILLIMETRE)
        small.mat(solid.name)
        for face, original in zip(small.faces, solid.faces, strict=True):
            face.name = original.name
        scaled.append(small)
    return scaled[0] if len(scaled) == 1 else Glue(scaled)


def _name_interfaces(body: Any) -> None:
    """Name the faces that belong to two solids."""
    owners = Counter(tuple(round(v, 9) for v in face.center) for solid in body.solids for face in solid.faces)
    for face in body.faces:
        if owners[tuple(round(v, 9) for v in face.center)] > 1:
            face.name = INTERFACE


def _apply(patches: tuple[SurfacePatch, ...], body: Any) -> None:
    if not patches:
        return
    faces = list(body.faces)
    names, index = patched(
        [face.name for face in faces],
        np.arange(len(faces)),
        np.array([[face.center[i] for i in range(3)] for face in faces]),
        patches,
    )
    for face, i in zip(faces, index, strict=True):
        face.name = names[i]
