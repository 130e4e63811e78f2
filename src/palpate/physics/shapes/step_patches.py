"""Names for parts of the faces of a STEP file: by the way that they face, or by a box in which no face has its centre.

A curved face faces many ways, and the CAD kernel knows it as one. So where a patch takes parts of faces, they
carry their numbers into the mesh, and the mesh's triangles get their names there: those of one face that belong to
different patches become faces of the mesh of their own. They stay on the CAD face, so curved elements follow it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.physics.shapes.body_file import SurfacePatch, apply_patches
from palpate.physics.shapes.naming import INTERFACE

__all__ = ["FacePatches", "cuts_faces", "number_faces"]

MARK = "#"  # before a face's number; `plain_name` leaves none in the names of a file


@dataclass(frozen=True)
class FacePatches:
    """Patches to be named in a mesh of a solid, whose faces are called by their numbers until then."""

    names: tuple[str, ...]  # of the file, face by face
    centres: np.ndarray  # (f, 3) of the faces, m
    patches: tuple[SurfacePatch, ...]  # those without a direction take whole faces by their centres

    def name_mesh(self, mesh: Any) -> None:
        """Give the faces of a `netgen.meshing.Mesh` their names, and parts of them faces of their own."""
        points = np.array([point.p for point in mesh.Points()])
        elements = list(mesh.Elements2D())
        corners = points[np.array([[vertex.nr - 1 for vertex in e.vertices[:3]] for e in elements])]
        descriptors = [mesh.FaceDescriptor(i + 1) for i in range(mesh.GetNFaceDescriptors())]
        own = np.array(
            [int(d.bcname.removeprefix(MARK)) if d.bcname.startswith(MARK) else -1 for d in descriptors]
        )
        inwards = np.array([d.domout != 0 for d in descriptors])
        index = np.array([e.index for e in elements]) - 1
        face = own[index]
        outer = np.flatnonzero(face >= 0)
        normals = _normals(corners[outer], inwards[index[outer]])
        labels = self.labels(face[outer], corners[outer].mean(axis=1), normals)
        names: dict[tuple[int, str], int] = {}
        for place, label in zip(outer.tolist(), labels, strict=True):
            at = int(index[place])
            if (at, label) not in names:
                fresh = all(number != at for number, _ in names)
                names[at, label] = at + 1 if fresh else _descriptor(mesh, at + 1)
                mesh.FaceDescriptor(names[at, label]).bcname = label
            elements[place].index = names[at, label]

    def labels(self, face: np.ndarray, centres: np.ndarray, normals: np.ndarray) -> list[str]:
        """Return the name of each of t triangles.

        `face` (t,) is the number of the face that a triangle is part of; `centres` (t, 3) are in m, `normals` (t,
        3) outward unit vectors.
        """
        label = np.array([self.names[i] for i in face], dtype=object)
        given = label.copy()
        for patch in self.patches:
            cut = cuts_faces(patch, self.names, self.centres)
            places = centres if cut else self.centres[face]
            left, index = apply_patches(*_numbered(given), places, (patch,), normals)
            label[np.array([left[i] == patch.name for i in index])] = patch.name
        return [str(name) for name in label]


def cuts_faces(patch: SurfacePatch, names: tuple[str, ...], centres: np.ndarray) -> bool:
    """Return whether a patch takes parts of faces: by their direction, or in a box in which no face has its centre."""
    if patch.facing is not None:
        return True
    return not patch.contains(centres, None, np.array(names, dtype=object)).any()


def _numbered(names: np.ndarray) -> tuple[tuple[str, ...], np.ndarray]:
    """Return the names that occur, and the place of each name among them."""
    unique, index = np.unique(names.astype(str), return_inverse=True)
    return tuple(unique.tolist()), index


def _normals(corners: np.ndarray, inwards: np.ndarray) -> np.ndarray:
    """Return outward unit normals (t, 3) of the triangles of a closed surface, some of which are turned."""
    a, b, c = np.moveaxis(corners, 1, 0)
    areas = np.cross(b - a, c - a) * np.where(inwards, -1.0, 1.0)[:, None]
    volume = np.einsum("ij,ij->", areas, corners.mean(axis=1) - corners.reshape(-1, 3).mean(axis=0))
    lengths = np.linalg.norm(areas, axis=1)[:, None]
    return np.asarray(np.sign(volume) * areas / np.where(lengths > 0, lengths, 1.0))


def _descriptor(mesh: Any, like: int) -> int:
    """Add a face to a mesh that lies on the same CAD face as another; its number."""
    from netgen.meshing import FaceDescriptor

    old = mesh.FaceDescriptor(like)
    number = mesh.GetNFaceDescriptors() + 1
    new = FaceDescriptor(surfnr=old.surfnr, domin=old.domin, domout=old.domout, bc=number)
    return int(mesh.Add(new))


def number_faces(patches: tuple[SurfacePatch, ...], body: Any) -> FacePatches:
    """Call the outer faces of a solid by their numbers, and return what names their meshes."""
    faces = [face for face in body.faces if face.name != INTERFACE]
    names = tuple(face.name for face in faces)
    centres = np.array([[face.center[i] for i in range(3)] for face in faces])
    for number, face in enumerate(faces):
        face.name = f"{MARK}{number}"
    return FacePatches(names, centres, patches)
