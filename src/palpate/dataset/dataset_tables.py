"""A dataset as a table of other tools: CSV, Parquet and netCDF, one row or one sample for each solve.

Columns are named `name [unit]`; components of vectors and matrices are numbered from 1, `response_2`,
`response_gradient_12`. Fields over the nodes don't go into a table of solves: `write_fields_csv` writes them, one row
for each node of each solve. netCDF files hold everything; they are of the classic format with 64-bit offsets, which
every netCDF tool reads.
"""

from __future__ import annotations

import csv
import io
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.errors import UsageError
from palpate.files import write_file, writing
from palpate.output_files import require_outputs

if TYPE_CHECKING:
    from palpate.dataset.dataset import Dataset

__all__ = ["TABLES", "columns_of", "write_fields_csv", "write_table"]

TABLES = (".csv", ".parquet", ".nc")
"""Ends of the names of files that hold a table of solves."""

_FIELD_DIMS = ("node", "component")


def write_table(data: Dataset, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
    """Write the solves of a dataset to a file; its ending decides the format: .csv, .parquet or .nc.

    Rows that did not converge are written too, with their reason in `message`. Parquet files need pyarrow.
    """
    target = Path(path)
    ending = target.suffix.lower()
    if ending in TABLES:
        require_outputs([target], overwrite=overwrite)
    if ending == ".csv":
        return _write_csv(target, columns_of(data))
    if ending == ".parquet":
        return _write_parquet(target, data)
    if ending == ".nc":
        return _write_netcdf(target, data)
    raise UsageError(
        f"{target} names no table that can be written.",
        why=f"The ending {ending or 'none'!r} is none of {', '.join(TABLES)}.",
        fix="End the name in .csv, .parquet or .nc.",
    )


def columns_of(data: Dataset) -> list[tuple[str, str, np.ndarray]]:
    """Return name, unit and values (N,) of each column: inputs, then every answer that is no field over the nodes."""
    columns = [(r.name, r.unit, data.X[:, k]) for k, r in enumerate(data.ranges)]
    for name in map(str, data.data.data_vars):
        variable = data.data[name]
        dims = [str(d) for d in variable.dims]
        if name == "inputs" or not dims or dims[0] != "sample" or "node" in dims:
            continue
        values = np.asarray(variable.values).reshape(len(data), -1)
        units = _units(str(variable.attrs.get("unit", variable.attrs.get("units", ""))), values.shape[1])
        shape = variable.shape[1:]
        for k in range(values.shape[1]):
            place = "".join(str(i + 1) for i in np.unravel_index(k, shape)) if shape else ""
            columns.append((f"{name}_{place}" if place else name, units[k], values[:, k]))
    return columns


def write_fields_csv(data: Dataset, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
    """Write the fields over the nodes as CSV: a row for each node of each solve that converged.

    The path is such as ``NAME-fields.csv``.
    """
    require_outputs([path], endings=(".csv",), overwrite=overwrite)
    fields = [
        str(n) for n in data.data.data_vars if "node" in data.data[n].dims and "sample" in data.data[n].dims
    ]
    if not fields:
        raise UsageError("The dataset has no fields over nodes.", fix="Export the table of its solves alone.")
    nodes = len(data.rest)
    rows = np.flatnonzero(data.converged)
    axes = "xyz"[: data.rest.shape[1]]
    columns: list[tuple[str, str, np.ndarray]] = [
        ("sample", "", np.repeat(rows, nodes)),
        ("node", "", np.tile(np.arange(nodes), len(rows))),
        *((axis, "m", np.tile(data.rest[:, k], len(rows))) for k, axis in enumerate(axes)),
    ]
    for name in fields:
        values = np.asarray(data[name])[rows].reshape(len(rows) * nodes, -1)
        units = _units(
            str(data.data[name].attrs.get("unit", data.data[name].attrs.get("units", ""))), values.shape[1]
        )
        one = values.shape[1] == 1
        columns += [
            (name if one else f"{name}_{k + 1}", units[k], values[:, k]) for k in range(values.shape[1])
        ]
    return _write_csv(Path(path), columns)


def _units(text: str, count: int) -> list[str]:
    """Return a unit for each of `count` columns: one for all, or one each, with commas between."""
    parts = [part.strip() for part in text.split(",")]
    return parts if len(parts) == count else [text if "," not in text else ""] * count


def _write_csv(target: Path, columns: list[tuple[str, str, np.ndarray]]) -> Path:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([f"{name} [{unit}]" if unit else name for name, unit, _ in columns])
    cells = [_cells(values) for _, _, values in columns]
    writer.writerows(zip(*cells, strict=True))
    return write_file(target, text.getvalue())


def _cells(values: np.ndarray) -> Iterator[str]:
    """Yield the values as text that gives them back to the last bit; nothing where one is not a number."""
    for value in values.tolist():
        if isinstance(value, float):
            yield repr(value) if np.isfinite(value) else ""
        elif isinstance(value, bool):
            yield str(int(value))
        else:
            yield str(value)


def _write_parquet(target: Path, data: Dataset) -> Path:
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError as error:
        raise UsageError(
            "Parquet files can't be written.",
            why="The package pyarrow is not installed.",
            fix="Run: pip install 'palpate[parquet]'",
        ) from error
    columns = columns_of(data)
    arrays = [pa.array(values.tolist() if values.dtype.kind in "OU" else values) for _, _, values in columns]
    fields = [
        pa.field(name, array.type, metadata={"unit": unit} if unit else None)
        for (name, unit, _), array in zip(columns, arrays, strict=True)
    ]
    schema = pa.schema(
        fields, metadata={"palpate hash": data.hash, "palpate provenance": data.data.attrs["provenance"]}
    )
    with writing(target) as part:
        pq.write_table(pa.Table.from_arrays(arrays, schema=schema), part)
    return target


def _write_netcdf(target: Path, data: Dataset) -> Path:
    """Write everything with xarray and SciPy; booleans and long whole numbers become numbers that the format has."""
    content = data.data.copy()
    for name in list(content.variables):
        variable = content[name]
        if variable.dtype.kind == "b":
            content[name] = variable.astype(np.int8).assign_attrs(
                {**variable.attrs, "flag_meanings": "false true"}
            )
        elif variable.dtype.kind in "iu" and variable.dtype.itemsize > 4:
            content[name] = variable.astype(np.int32)
    content.attrs = {k: _plain(v) for k, v in content.attrs.items()}
    content.attrs["palpate_hash"] = data.hash
    for name in content.variables:
        attrs = {re.sub(r"\W+", "_", str(k)): _plain(v) for k, v in content[name].attrs.items()}
        if "unit" in attrs:  # as the CF conventions call it
            attrs["units"] = attrs["unit"]
        content[name].attrs = attrs
        content[name].encoding = {}
    with writing(target) as part:
        content.to_netcdf(part, engine="scipy", format="NETCDF3_64BIT")
    return target


def _plain(value: Any) -> Any:
    return int(value) if isinstance(value, bool | np.bool_) else value
