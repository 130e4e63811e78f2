"""A recorded touch as a table: one row a tick, one column a quantity, for other programs.

=========  ============================================================================
``.csv``   text, with a head of names and units
``.npz``   arrays of NumPy, with the header as JSON
``.parquet``  columns with their types; needs ``pip install 'palpate[parquet]'``
=========  ============================================================================
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from palpate.devices.tick_record import FLAGS
from palpate.devices.trace_file import Trace
from palpate.errors import UsageError
from palpate.files import writing
from palpate.output_files import require_outputs

__all__ = ["FORMATS", "UNITS", "export_trace", "trace_table"]

_VECTORS = {
    "hand": ("hand", "m"),
    "position": ("position", "m"),
    "contact": ("contact", "m"),
    "wanted": ("force_wanted", "N"),
    "force": ("force", "N"),
    "sent": ("force_sent_to_device", "N"),
}
_NUMBERS = {
    "lateness": "s",
    "depth": "m",
    "stiffness": "N/m",
    "delay": "s",
    "coupling": "N/m",
    "sample_time": "s",
}
_LEDGER = (
    ("energy", "J"),
    ("energy_lowest", "J"),
    ("added_damping", "N s/m"),
    ("damping_energy", "J"),
    ("leak", "m2"),
)

UNITS: dict[str, str] = (
    {"time": "s"}
    | {f"{name}_{axis}": unit for name, unit in (*_VECTORS.values(), ("velocity", "m/s")) for axis in "xyz"}
    | _NUMBERS
    | dict(_LEDGER)
)
"""Units of the table's columns; the others are counts, flags, or inputs of the body with units of their own."""


def trace_table(trace: Trace) -> dict[str, np.ndarray]:
    """Return the columns of a trace, each (N,), by name.

    Times count from the first tick. The hand is x right, y up, z towards the user; forces on it and places of contact
    are in the body's axes, what was sent in the device's. `UNITS` has the units.
    """
    ticks = trace.ticks
    table: dict[str, np.ndarray] = {"tick": ticks["tick"], "time": trace.time}
    for key, (name, _) in _VECTORS.items():
        table |= {f"{name}_{axis}": ticks[key][:, k] for k, axis in enumerate("xyz")}
        if key == "hand":
            table |= {f"velocity_{axis}": trace.velocity[:, k] for k, axis in enumerate("xyz")}
    table |= {name: ticks[name] for name in _NUMBERS}
    table["sample_time"] = ticks["sample_time"] - ticks["time"][:1]
    table |= {name: ticks["ledger"][:, k] for k, (name, _) in enumerate(_LEDGER)}
    table |= {
        f"input_{name}": column
        for name, column in zip(trace.header.get("parameters", ()), trace.parameters.T, strict=True)
    }
    return table | {"fault": ticks["fault"]} | {name: trace.flag(name) for name in FLAGS}


def export_trace(trace: Trace, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
    """Write a trace as a table; the file's ending says in which of `FORMATS`.

    A file that exists is replaced where `overwrite` is True. Parquet needs pyarrow.
    """
    target = Path(path)
    write = FORMATS.get(target.suffix)
    if write is None:
        raise UsageError(
            f"{target.name} names no format of a table.", fix=f"Let it end with {', '.join(FORMATS)}."
        )
    require_outputs([target], overwrite=overwrite)
    with writing(target) as part:
        write(trace, part)
    return target


def _write_csv(trace: Trace, path: Path) -> None:
    table = trace_table(trace)
    head = ",".join(f"{name} [{UNITS[name]}]" if name in UNITS else name for name in table)
    columns = [
        column.tolist() if column.dtype != bool else column.astype(int).tolist() for column in table.values()
    ]
    with open(path, "w", encoding="utf-8", newline="\n") as file:
        file.write(head + "\n")
        for row in zip(*columns, strict=True):
            # repr: the shortest text that reads back to the same bits
            file.write(",".join(map(repr, row)) + "\n")


def _write_npz(trace: Trace, path: Path) -> None:
    columns: dict[str, Any] = dict(trace_table(trace))
    with path.open("wb") as file:
        np.savez_compressed(file, header=np.array(json.dumps(dict(trace.header))), **columns)


def _write_parquet(trace: Trace, path: Path) -> None:
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError as error:
        raise UsageError(
            "Parquet files need pyarrow, which is not installed.",
            fix="Give pip install 'palpate[parquet]', or export to .npz or .csv.",
        ) from error
    table = pa.table(trace_table(trace))
    metadata = {"palpate": json.dumps(dict(trace.header)), "units": json.dumps(UNITS)}
    pq.write_table(table.replace_schema_metadata(metadata), path)


FORMATS: dict[str, Callable[[Trace, Path], None]] = {
    ".csv": _write_csv,
    ".npz": _write_npz,
    ".parquet": _write_parquet,
}
"""Formats by the ending of a file's name."""
