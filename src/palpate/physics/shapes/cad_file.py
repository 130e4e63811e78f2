"""Solids of files of the CAD kernel: STEP, IGES and BREP, with the names of faces and solids.

read_cad      the solids in m, glued where they touch; faces without a solid are sewn into one
states_unit   whether a file states the unit of its numbers
"""

from __future__ import annotations

from collections import Counter
from os import PathLike
from typing import Any

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.file_kinds import part_ending
from palpate.format import number
from palpate.physics.shapes.body_file import UNITS, SurfacePatch, apply_patches
from palpate.physics.shapes.naming import INTERFACE, plain_name
from palpate.physics.shapes.packed_file import plain_file
from palpate.physics.shapes.shape import require_size
from palpate.physics.shapes.step_patches import FacePatches, cuts_faces, number_faces

__all__ = ["read_cad", "states_unit"]

SHARED = 1e-6  # of a solid's volume: what two solids may have in common by rounding
MILLIMETRE = 1e-3  # the CAD kernel turns every unit that a STEP or IGES file states into mm
SEAMS = (1e-6, 1e-5, 1e-4)  # of the length: how far edges of faces that belong together may be apart
# the endings by which Netgen tells the formats
_KINDS = {
    **dict.fromkeys((".step", ".stp"), "STEP"),
    **dict.fromkeys((".iges", ".igs"), "IGES"),
    **dict.fromkeys((".brep", ".brp"), "BREP"),
}


def states_unit(path: str | PathLike[str]) -> bool:
    """Return whether files of this ending state the unit of their numbers."""
    return _KINDS.get(part_ending(path)) in ("STEP", "IGES")


def read_cad(
    path: str, unit: str | None, patches: tuple[SurfacePatch, ...]
) -> tuple[Any, tuple[str, ...], FacePatches | None]:
    """Read the solids of a CAD file, glued where they touch.

    A face is called by its name, else by its colour (``colour ff0000``), else ``face 1``, ``face 2``, … in the
    order of the file, with the solid's name before it where there are several; a solid by its name, else ``body``,
    or ``body 1``, ``body 2``, …. Where a face is covered in part, the rest keeps its name.

    `unit` is that of a BREP file's numbers; STEP and IGES state their own. Returns the body (a
    netgen.occ.TopoDS_Shape in m), a note about each thing that was left out, sewn or renamed, and, where a patch is
    chosen by its direction, what names the faces of a mesh of the solid; until then they are called by numbers.
    """
    solids, notes = _solids(path, _load(path))
    for index, solid in enumerate(solids):
        solid.name = (
            plain_name(solid.name) if solid.name else "body" if len(solids) == 1 else f"body {index + 1}"
        )
    solids, left_out = _without_overlap(path, solids)
    notes += [*left_out, *_number_names(solids)]
    for solid in solids:
        _name_faces(solid, "" if len(solids) == 1 else f"{solid.name} ")
        solid.mat(solid.name)
    body = _scale_to_metres(solids, MILLIMETRE if unit is None else UNITS[unit])
    low, high = body.bounding_box
    require_size(path, max(high[i] - low[i] for i in range(3)), unit or "stated in the file")
    _name_interfaces(body)
    outer = [face for face in body.faces if face.name != INTERFACE]
    names, centres = (
        tuple(face.name for face in outer),
        np.array([[f.center[i] for i in range(3)] for f in outer]),
    )
    if any(cuts_faces(patch, names, centres) for patch in patches):
        return body, tuple(notes), number_faces(patches, body)
    _name_patches(patches, body)
    return body, tuple(notes), None


def _without_overlap(path: str, solids: list[Any]) -> tuple[list[Any], list[str]]:
    """Leave out solids that are there twice, and refuse those that share a volume; names are set."""
    kept: list[Any] = []
    notes = []
    for solid in solids:
        for other in kept:
            if not _boxes_meet(solid, other):
                continue
            common = solid * other
            if common.mass <= SHARED * min(solid.mass, other.mass):
                continue
            if common.mass >= (1 - SHARED) * max(solid.mass, other.mass):
                notes.append(f"The solid {solid.name!r} is the same as {other.name!r}, and was left out.")
                break
            nested = common.mass >= (1 - SHARED) * min(solid.mass, other.mass)
            raise UsageError(
                f"The solids {other.name!r} and {solid.name!r} of {path} overlap by {number(common.mass, 3)} mm³.",
                why=f"{'One lies inside the other, around' if nested else 'They do so around'} "
                f"({', '.join(number(v, 4) for v in common.center)}) mm; a place can have one material only.",
                fix="Cut one out of the other in the CAD program (subtract, keep both), so that they touch in a face.",
            )
        else:
            kept.append(solid)
    return kept, notes


def _boxes_meet(solid: Any, other: Any) -> bool:
    (low, high), (other_low, other_high) = solid.bounding_box, other.bounding_box
    return all(low[i] < other_high[i] and other_low[i] < high[i] for i in range(3))


def _load(path: str) -> Any:
    from netgen.meshing import NgException
    from netgen.occ import OCCException, OCCGeometry

    kind = _KINDS[part_ending(path)]
    try:
        with plain_file(path, f".{kind.lower()}") as plain:
            return OCCGeometry(plain).shape
    except (NgException, OCCException, RuntimeError) as error:
        raise FileFormatError(
            f"The file {path} can't be read as {kind}.",
            why=f"It is corrupt, cut short or of another format ({str(error).strip()}).",
            fix="Open it in the CAD program and export it again as STEP AP214 or AP242.",
        ) from error


def _solids(path: str, shape: Any) -> tuple[list[Any], list[str]]:
    """Return the solids of a file, those of closed shells where it has none, and a note on what was done."""
    solids, faces = list(shape.solids), list(shape.faces)
    if solids:
        loose = len(faces) - len({face for solid in solids for face in solid.faces})
        left = "1 face that belongs" if loose == 1 else f"{loose} faces that belong"
        return solids, [f"{left} to no solid: left out."] if loose else []
    if not faces:
        raise FileFormatError(
            f"The file {path} holds no shape.",
            why="The CAD kernel found neither solids nor faces in it: it is empty, cut short or damaged.",
            fix="Open it in the CAD program and export the solid again.",
        )
    from netgen.occ import Sew, Solid

    low, high = shape.bounding_box
    length = max(high[i] - low[i] for i in range(3))
    lone: list[Any] = []
    for seam in SEAMS:
        sewn = Sew(faces, tolerance=seam * length)
        count = Counter(edge for face in sewn.faces for edge in face.edges)
        lone = [edge.center for edge, times in count.items() if times == 1]
        if not lone and len(list(sewn.faces)) == len(faces):
            solids = [Solid(shell) for shell in sewn.shells]
            sewn_into = "a solid" if len(solids) == 1 else f"{len(solids)} solids"
            note = f"It holds {len(faces)} faces and no solid: they were sewn into {sewn_into}."
            return [solid if solid.mass > 0 else solid.Reversed() for solid in solids], [note]
    where = (
        ", ".join(f"{v * MILLIMETRE:.4g}" for v in np.mean([list(p) for p in lone], axis=0)) if lone else "?"
    )
    raise UsageError(
        f"{path} holds no solid: its surface is open, {len(lone)} edges belong to one face only.",
        why=f"There is a hole around ({where}) m, or the faces lie further apart than {SEAMS[-1]:g} of the length.",
        fix="Close and sew the faces in the CAD program, and export a solid.",
    )


def _number_names(solids: list[Any]) -> list[str]:
    """Number the solids that share a name, and return a note on each such name."""
    shared = [name for name, times in Counter(solid.name for solid in solids).items() if times > 1]
    notes = []
    for name in shared:
        same = [solid for solid in solids if solid.name == name]
        for number_of, solid in enumerate(same, 1):
            solid.name = f"{name} {number_of}"
        notes.append(f"{len(same)} solids are called {name!r}: they are the regions {name} 1 to {len(same)}.")
    return notes


def _name_faces(solid: Any, before: str) -> None:
    """Name the faces of a solid; `before` stands before the number of one that the file tells nothing about."""
    for index, face in enumerate(solid.faces):
        if face.name:
            face.name = plain_name(face.name)
        elif face.col is not None:
            red, green, blue = (round(255 * v) for v in tuple(face.col)[:3])
            face.name = f"colour {red:02x}{green:02x}{blue:02x}"
        else:
            face.name = f"{before}face {index + 1}"


def _scale_to_metres(solids: list[Any], factor: float) -> Any:
    from netgen.occ import Glue, Pnt

    scaled = []
    for solid in solids:
        small = solid.Scale(Pnt(0, 0, 0), factor)
        small.mat(solid.name)
        for face, original in zip(small.faces, solid.faces, strict=True):
            face.name = original.name
        scaled.append(small)
    return scaled[0] if len(scaled) == 1 else Glue(scaled)


def _name_interfaces(body: Any) -> None:
    """Name the faces that belong to two solids: by their identity, since many have the same centre."""
    owners = Counter(face for solid in body.solids for face in solid.faces)
    for face in body.faces:
        if owners[face] > 1:
            face.name = INTERFACE


def _name_patches(patches: tuple[SurfacePatch, ...], body: Any) -> None:
    if not patches:
        return
    # a wall between solids may have its centre in a patch, too, and is no part of the surface
    faces = [face for face in body.faces if face.name != INTERFACE]
    names, index = apply_patches(
        [face.name for face in faces],
        np.arange(len(faces)),
        np.array([[face.center[i] for i in range(3)] for face in faces]),
        patches,
    )
    for face, i in zip(faces, index, strict=True):
        face.name = names[i]
