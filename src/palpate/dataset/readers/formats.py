"""Formats of other solvers' results, one file each, and the one door to all of them: `read_results`."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from palpate.dataset.readers import (
    abaqus_odb,
    abaqus_report,
    array_files,
    calculix_dat,
    calculix_frd,
    comsol,
    febio_records,
    solver_meshes,
    text_tables,
    vtk_files,
)
from palpate.dataset.readers.file_text import head_of
from palpate.dataset.readers.results import Results, refuse

__all__ = ["FORMATS", "Format", "read_results"]


@dataclass(frozen=True)
class Format:
    """One format of results.

    Attributes
    ----------
    name : str
        Name for messages.
    suffixes : tuple of str
        Endings of its files, in lower case.
    read : function of a path
        Reader; it raises `FileFormatError` with the line of what it can't read.
    matches : function of the file's first 4 kB as text, optional
        Test for files of an ending that several formats share.
    """

    name: str
    suffixes: tuple[str, ...]
    read: Callable[[Path], Results]
    matches: Callable[[str], bool] | None = None


FORMATS = (
    Format("CalculiX results", (".frd",), calculix_frd.read_frd, calculix_frd.is_frd),
    Format("CalculiX printed results", (".dat",), calculix_dat.read_dat, calculix_dat.is_dat),
    Format("COMSOL text export", (".txt", ".csv", ".dat", ".asc"), comsol.read_comsol, comsol.is_comsol),
    Format("Abaqus report", (".rpt",), abaqus_report.read_report, abaqus_report.is_report),
    Format("Abaqus output database", (".odb",), abaqus_odb.refuse_odb),
    Format(
        "FEBio data record", (".log", ".txt", ".dat"), febio_records.read_records, febio_records.is_record
    ),
    Format("Exodus, EnSight, OpenFOAM, CGNS, XDMF", solver_meshes.SUFFIXES, solver_meshes.read_mesh_results),
    Format("VTK files", vtk_files.SUFFIXES, vtk_files.read_vtk),
    Format("NumPy arrays", (".npz",), array_files.read_npz),
    Format("text tables", text_tables.SUFFIXES, text_tables.read_text_table),
    Format("Parquet tables", (".parquet", ".pq"), array_files.read_parquet),
)


def read_results(path: str | os.PathLike[str]) -> Results:
    """Read a file of another solver's results.

    Parameters
    ----------
    path : path
        COMSOL's text exports, CalculiX's ``.frd`` and ``.dat``, reports of Abaqus, data records of FEBio, Exodus,
        EnSight, OpenFOAM, CGNS, XDMF, ``.vtu``, ``.pvd`` and others of VTK, ``.npz``, ``.parquet`` or a text table.

    Returns
    -------
    Results
        Columns with names and units, by case and place; ``print`` lists them.

    Raises
    ------
    FileFormatError
        If the file is missing, damaged or of an unknown format.
    UsageError
        If a package is missing that its format needs.
    """
    path = Path(path)
    if not path.is_file():
        raise refuse(path, None, "there is no such file.", fix="Check the path.")
    suffix, head = path.suffix.lower(), head_of(path)
    if not head.strip() and suffix not in solver_meshes.EMPTY:
        raise refuse(path, 1, "the file is empty.", why="The solver printed nothing, or was stopped.")
    near = [form for form in FORMATS if suffix in form.suffixes]
    for form in near:
        if form.matches is None or form.matches(head):
            return form.read(path)
    by_content = [form for form in FORMATS if form.matches is not None and form.matches(head)]
    if by_content:
        return by_content[0].read(path)
    if near:
        return near[0].read(path)  # which says where it differs
    first = next((line.strip() for line in head.splitlines() if line.strip()), "")
    raise refuse(
        path,
        1,
        "the file begins like no format that is known.",
        why=f"It begins with {first[:60]!r}."
        if first.isprintable()
        else "It begins with bytes that are no text.",
        fix=f"Formats that are read: {', '.join(f'{form.name} ({form.suffixes[0]})' for form in FORMATS)}.",
    )
