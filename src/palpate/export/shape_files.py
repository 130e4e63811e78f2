"""Shapes for pictures: the states of a dataset or of a learnt body's stroke, as VTU series and as glTF."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from palpate.dataset import Dataset
from palpate.dataset.carried_surface import (
    CarriedSurface,
    has_middles,
    quarter_triangles,
    surface_nodes,
    surface_values,
)
from palpate.errors import UsageError
from palpate.export.gltf import MOST_TARGETS, ShapeSeries, write_glb
from palpate.files import writing, writing_folder
from palpate.output_files import require_outputs, seal
from palpate.surrogates import Surrogate

__all__ = ["SHAPES", "series_of_dataset", "series_of_surrogate", "write_shapes", "write_vtu_series"]

SHAPES = (".pvd", ".vtu", ".glb")
"""Ends of the names of files that hold shapes."""

_STATE = re.compile(r"\d{4,}\.vtu")  # names of the files of a series


def write_shapes(
    series: ShapeSeries,
    path: str | os.PathLike[str],
    *,
    targets: int = MOST_TARGETS,
    card: dict[str, Any] | None = None,
    overwrite: bool = False,
) -> Path:
    """Write shapes; the ending decides: .pvd (VTU files for ParaView), .vtu (the last state alone), or .glb.

    A GLB file has at most `targets` morph targets, and a model card. `overwrite` replaces files whatever they are; by
    default those alone that an earlier export wrote.
    """
    ending = Path(path).suffix.lower()
    if ending == ".glb":
        return write_glb(series, path, targets=targets, card=card, overwrite=overwrite)
    if ending == ".pvd":
        return write_vtu_series(series, path, overwrite=overwrite)
    if ending == ".vtu":
        require_outputs([path], overwrite=overwrite)
        _write_state(series, len(series.values) - 1, Path(path))
        return Path(path)
    raise UsageError(
        f"{path} names no file of shapes.",
        why=f"The ending {ending or 'none'!r} is none of {', '.join(SHAPES)}.",
        fix="End the name in .pvd, .vtu or .glb.",
    )


def write_vtu_series(series: ShapeSeries, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
    """Write a PVD file, which ParaView plays, and a folder of VTU files beside it.

    Points are those at rest in m, z up; point data are ``displacement`` (m) and the series' other fields, in SI units.
    `overwrite` is that of `write_shapes`.
    """
    target = Path(path)
    folder = target.with_suffix("")
    _require_own(folder, target)
    states = sorted(folder.iterdir()) if folder.exists() else []
    require_outputs([target, *states], overwrite=overwrite)
    collection = ElementTree.Element("VTKFile", type="Collection", version="0.1")
    entries = ElementTree.SubElement(collection, "Collection")
    with writing_folder(folder) as part:
        part.mkdir(parents=True, exist_ok=True)
        for step, value in enumerate(series.values.tolist()):
            name = f"{step:04d}.vtu"
            _write_state(series, step, part / name)
            entry = {"timestep": f"{value:.17g}", "group": "", "part": "0", "file": f"{folder.name}/{name}"}
            ElementTree.SubElement(entries, "DataSet", entry)
    with writing(target) as part:
        ElementTree.ElementTree(collection).write(part, encoding="utf-8", xml_declaration=True)
        seal(part)
    return target


def _require_own(folder: Path, target: Path) -> None:
    """Refuse a folder that holds anything but the states of an earlier series: it would be replaced."""
    if not folder.exists():
        return
    other = [folder] if not folder.is_dir() else [p for p in folder.iterdir() if not _STATE.fullmatch(p.name)]
    if other:
        raise UsageError(
            f"The folder {folder} would be replaced by the states of {target.name}, and it holds {other[0].name}.",
            why="The states of a series lie in a folder of its name.",
            fix="Give the series another name with -o, or move what is there.",
        )


def _write_state(series: ShapeSeries, step: int, path: Path) -> None:
    import meshio

    kind = "triangle" if series.cells.shape[1] == 3 else "line"
    data = {"displacement": series.displacement[step]}
    data |= {name: values[step] for name, values in series.fields.items()}
    grid = meshio.Mesh(series.points, [(kind, series.cells)], point_data=data)
    with writing(path) as part:
        meshio.vtu.write(part, grid, header_type="UInt64")
        seal(part)


def series_of_dataset(data: Dataset, rows: Sequence[int] | None = None, name: str = "body") -> ShapeSeries:
    """Return the displaced shapes of a dataset's converged solves, numbered by their rows; of all rows by default."""
    if "displacement" not in data:
        raise UsageError(
            "The dataset has no displacement.", fix="Export it as a table: .csv, .parquet or .nc."
        )
    count = len(data)
    wanted = np.arange(count) if rows is None else np.asarray(rows, dtype=np.int64)
    if wanted.size and not (wanted.min() >= 0 and wanted.max() < count):
        raise UsageError(f"The dataset has {count} rows, counted from 0.", fix="Choose among these.")
    kept = wanted[data.converged[wanted]] if wanted.size else wanted
    if not kept.size:
        raise UsageError("None of these solves converged.", fix="Choose other rows.")
    flat = data.rest.shape[1] == 2  # a beam: its third component is a rotation
    u = data.displacement[kept]
    points, u = (_upright(data.rest), _upright(u[..., :2])) if flat else (data.rest, u)
    cells = _pieces(data.rest[:, 0]) if "triangles" not in data else data.triangles
    fields = {"von Mises stress": data["von_mises"][kept]} if "von_mises" in data else {}
    if has_middles(good := data.take(kept)):
        nodes, parts = surface_nodes(data.rest, data.triangles, middles=True)
        own = CarriedSurface.bind(data["drawn_points"], data["drawn_triangles"], nodes, parts)
        points, cells = own.points, own.triangles
        known = {"u": "displacement"} | ({"von Mises stress": "von_mises"} if fields else {})
        carried = {
            key: own.carry(surface_values(good, name, middles=True), quarter_triangles(parts))
            for key, name in known.items()
        }
        u = carried.pop("u")
        fields = {name: values[..., 0] for name, values in carried.items()}
    order = np.arange(len(kept), dtype=float) if rows is not None else kept.astype(float)
    return ShapeSeries(points, cells, u, order, name, fields)


def series_of_surrogate(surrogate: Surrogate, X: np.ndarray) -> ShapeSeries:
    """Return the shapes at inputs X (k, n), numbered from 1, of a body that was learnt with its displacement."""
    shown, line = surrogate.surface_fields.get("displacement"), surrogate.line
    if shown is not None:
        (points, cells), u = shown.pictured, shown.at_pictured(shown.values(X))
    elif line is not None:
        cells = _pieces(line.points[:, 0])
        points, u = _upright(line.points[:, :2]), _upright(line.values(X)[..., :2])
    else:
        raise UsageError(
            f"The body {surrogate.name!r} has no shape.",
            why="It was learnt without its displacement.",
            fix="Learn it with shape=True.",
        )
    fields = {}
    if (stress := surrogate.surface_fields.get("von_mises")) is not None:
        fields["von Mises stress"] = stress.at_pictured(np.asarray(stress.values(X)))[..., 0]
    return ShapeSeries(points, cells, u, np.arange(1.0, len(u) + 1), surrogate.name, fields)


def _upright(flat: np.ndarray) -> np.ndarray:
    """Return plane vectors (..., 2), y up, in space with z up."""
    return np.stack([flat[..., 0], np.zeros_like(flat[..., 0]), flat[..., 1]], axis=-1)


def _pieces(along: np.ndarray) -> np.ndarray:
    """Return the pieces (T, 2) of a line between neighbouring nodes."""
    order = np.argsort(along, kind="stable")
    return np.stack([order[:-1], order[1:]], axis=1)
