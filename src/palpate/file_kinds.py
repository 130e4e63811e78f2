"""Kinds of files by the endings of their names, and the commands that take them, for messages about a wrong file."""

from __future__ import annotations

import contextlib
import gzip
import os
import zlib
from pathlib import Path

__all__ = [
    "CAD_ENDINGS",
    "DICOM_ENDING",
    "MESH_ENDINGS",
    "PART_FORMATS",
    "SCAN_ENDINGS",
    "SURFACE_ENDINGS",
    "file_kind",
    "part_ending",
    "part_kind",
    "way_for",
]

SURFACE_ENDINGS = (".stl", ".obj", ".ply", ".off", ".glb", ".vtp")
"""Ends of the names of files that hold a closed surface of triangles, which is filled with elements here."""

CAD_ENDINGS = (".step", ".stp", ".iges", ".igs", ".brep", ".brp")
"""Ends of the names of files of the CAD kernel, which hold solids, or faces to be sewn into one."""

MESH_ENDINGS = (
    *(".vtu", ".vtk", ".msh", ".mesh", ".meshb", ".inp", ".bdf", ".nas", ".fem", ".xdmf", ".xmf"),
    *(".node", ".ele", ".med", ".exo", ".e", ".h5m", ".avs", ".su2", ".f3grid", ".ugrid"),
)
"""Ends of the names of files that hold a volume mesh, which keeps its elements."""

DICOM_ENDING = ".dcm"
"""End of the names of slices of a DICOM series, which stands for all of it."""

SCAN_ENDINGS = (".nrrd", ".nii", ".mha", ".mhd", ".nhdr", DICOM_ENDING)
"""Ends of the names of files that hold a labelmap of a segmented scan."""

PART_FORMATS = (
    "a surface (STL, OBJ, PLY, OFF, GLB, VTP), solids (STEP, IGES, BREP), a volume mesh (VTU, VTK, MSH, INP, BDF, "
    "MED, XDMF and others), each also as NAME.gz, or the labelmap of a scan (NRRD, NIfTI, MHA, a folder of DICOM)"
)
"""Formats of parts, in words for a message."""

_HEAD = 1024  # bytes in which a legacy VTK file says what it holds

_TABLES = (".csv", ".tsv", ".txt", ".dat", ".xlsx", ".parquet", ".npz", ".npy", ".json")
_KINDS = {
    **dict.fromkeys(_TABLES, "a file of data"),
    **dict.fromkeys((*SURFACE_ENDINGS, *CAD_ENDINGS, *MESH_ENDINGS, *SCAN_ENDINGS), "a part"),
    ".palpate": "a model file",
    ".zarr": "a dataset of solves",
    ".toml": "a study file",
}
_WAYS = {
    "a file of data": "`palpate fit {0} --inputs … --outputs …` learns from a table.",
    "a part": "`palpate touch {0}` opens a part, `palpate init {0}` writes a study of it.",
    "a model file": "`palpate view {0}` shows a model, `palpate ask {0}` says what it holds.",
    "a dataset of solves": "`palpate learn {0}` learns from a dataset.",
    "a study file": "`palpate sweep {0}` and `palpate learn {0}` carry out a study.",
}


def file_kind(path: str | os.PathLike[str]) -> str:
    """Return what a file is by its name's ending, such as "a study file"; "" for an ending that tells nothing."""
    return _KINDS.get(part_ending(path), "")


def part_ending(path: str | os.PathLike[str]) -> str:
    """Return the end of a name in small letters, without a last ``.gz``: ``.stl`` of Part.STL.gz."""
    name = Path(path)
    return Path(name.stem).suffix.lower() if name.suffix.lower() == ".gz" else name.suffix.lower()


def part_kind(path: str | os.PathLike[str]) -> str:
    """Return what a part's file holds: "surface", "cad", "mesh" or "scan"; "" for a name that is no part's.

    Of legacy VTK files, which hold either, the first lines tell it. A folder is a DICOM series.
    """
    ending = part_ending(path)
    if Path(path).is_dir() and not file_kind(path):
        return "scan"
    if ending == ".vtk" and Path(path).is_file():
        opener = gzip.open if Path(path).suffix.lower() == ".gz" else open
        with contextlib.suppress(OSError, EOFError, zlib.error), opener(path, "rb") as file:
            return "surface" if b"POLYDATA" in file.read(_HEAD).upper() else "mesh"
    kinds = {"surface": SURFACE_ENDINGS, "cad": CAD_ENDINGS, "mesh": MESH_ENDINGS, "scan": SCAN_ENDINGS}
    return next((kind for kind, endings in kinds.items() if ending in endings), "")


def way_for(path: str | os.PathLike[str]) -> str:
    """Return a sentence that names the command for such a file; "" where its ending tells nothing."""
    return _WAYS.get(file_kind(path), "").format(path)
