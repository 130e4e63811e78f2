"""Bodies to look at from files: VTU, PVD, and datasets."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from palpate.errors import UsageError
from palpate.viewer.bodies import VON_MISES, ShownBody, ShownStep, figures, unreadable
from palpate.viewer.surfaces import outer_triangles

__all__ = ["body_of_dataset", "body_of_file"]

MOST_STEPS = 400  # of a dataset: a longer slider can't be moved by one


def body_of_file(path: Path, name: str = "") -> ShownBody:
    """A body from a .vtu, a .pvd or a dataset's folder.

    Raises
    ------
    FileFormatError
        If there is none, or nothing that can be shown.
    """
    if not path.exists():
        raise unreadable(path, "There is no such file.")
    if path.is_dir():
        from palpate.dataset import Dataset

        return body_of_dataset(Dataset.open(path), name or path.stem)
    if path.suffix == ".pvd":
        return _series(path, name or path.stem)
    return _vtu_body([path], ["1"], name or path.stem)


def body_of_dataset(dataset: Any, name: str) -> ShownBody:
    """The converged samples of a solid's dataset, at most 400 of them.

    Raises
    ------
    UsageError
        If it is no solid's dataset, or none of its samples converged.
    """
    data = dataset.data
    if "triangles" not in data:
        raise UsageError(
            "This dataset has no surface to show.",
            why="It was made of a beam or of a function.",
            fix="Show the dataset of a solid; a beam's is learnt and then shown by palpate view.",
        )
    rows = np.flatnonzero(data["converged"].values)
    if len(rows) > MOST_STEPS:
        rows = rows[np.linspace(0, len(rows) - 1, MOST_STEPS).astype(int)]
    origin = dataset.provenance
    radius = _radius(origin)
    rest = np.asarray(data["rest"].values, dtype=float)
    steps = [_sample(data, int(row), radius) for row in rows]
    return ShownBody(name, rest, np.asarray(data["triangles"].values), steps, fixed=_fixed(data, origin))


def _sample(data: Any, row: int, radius: float | None) -> ShownStep:
    sample = data.isel(sample=row)
    inputs = np.asarray(sample["inputs"].values, dtype=float)
    ball = (inputs, radius) if radius is not None and inputs.shape == (3,) else None
    response = sample["response"].values if "response" in sample else None
    energy = sample["potential_energy"].values if "potential_energy" in sample else None
    return ShownStep(
        displacement=np.asarray(sample["displacement"].values, dtype=float),
        ball=ball,
        label=f"sample {row}",
        figures=figures(response, energy, ball),
    )


def _fixed(data: Any, origin: Any) -> np.ndarray | None:
    """Which triangles belong to the surfaces that the body is fixed at, as far as the dataset tells."""
    names = origin.get("problem", {}).get("body", {}).get("fixed", ())
    if "surface" not in data or "surface_of" not in data:
        return None
    known = [str(name) for name in data["surface"].values]
    numbers = [known.index(name) for name in ([names] if isinstance(names, str) else names) if name in known]
    return np.isin(data["surface_of"].values, numbers)


def _radius(record: Any) -> float | None:
    """The radius of a sphere probe somewhere in a record of how a dataset was made."""
    if isinstance(record, dict):
        if record.get("type") == "SphereProbe":
            return float(record["radius"])
        record = list(record.values())
    if isinstance(record, list | tuple):
        return next((r for r in map(_radius, record) if r is not None), None)
    return None


def _series(path: Path, name: str) -> ShownBody:
    try:
        rows = ElementTree.parse(path).getroot().findall("Collection/DataSet")
    except ElementTree.ParseError as error:
        raise unreadable(path, str(error)) from error
    files = [path.parent / row.get("file", "") for row in rows]
    if not files:
        raise unreadable(path, "It names no files.")
    return _vtu_body(files, [f"t = {row.get('timestep', '')}" for row in rows], name)


def _vtu_body(paths: list[Path], labels: list[str], name: str) -> ShownBody:
    first = _read(paths[0])
    cells = first.cells_dict
    if "tetra" in cells:
        triangles = outer_triangles(cells["tetra"])
    elif "triangle" in cells:
        triangles = cells["triangle"]
    else:
        raise unreadable(
            paths[0], f"Its cells are {', '.join(cells) or 'none'}; tetrahedra or triangles are needed."
        )
    meshes = [first, *map(_read, paths[1:])]
    steps = [_vtu_step(mesh, label) for mesh, label in zip(meshes, labels, strict=True)]
    return ShownBody(name, np.asarray(first.points, dtype=float), triangles, steps, units={VON_MISES: "Pa"})


def _vtu_step(mesh: Any, label: str) -> ShownStep:
    count = len(mesh.points)
    values = {k: np.asarray(v, dtype=float) for k, v in mesh.point_data.items() if np.shape(v) == (count,)}
    notes = mesh.field_data
    ball = None
    if "probe centre and radius" in notes:
        probe = np.asarray(notes["probe centre and radius"], dtype=float).ravel()
        ball = (probe[:3], float(probe[3]))
    energy = np.ravel(notes["potential energy"])[0] if "potential energy" in notes else None
    response = np.ravel(notes["response"]) if "response" in notes else None
    displacement = np.asarray(mesh.point_data.get("displacement", np.zeros((count, 3))), dtype=float)
    return ShownStep(displacement, values, ball, label, figures(response, energy, ball))


def _read(path: Path) -> Any:
    import meshio
    from meshio import vtu  # meshio.read ends the program where it can't read

    try:
        return vtu.read(path)
    except (meshio.ReadError, OSError, ElementTree.ParseError, ValueError) as error:
        raise unreadable(path, str(error) or "It is no VTU file.") from error
