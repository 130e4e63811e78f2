"""Files of a soft-touch case: the body, its presses and closed paths, and the oracle's forces; NumPy is enough."""

from __future__ import annotations

import csv
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

__all__ = [
    "CASES",
    "Case",
    "JudgeError",
    "case_names",
    "columns_of",
    "order_of",
    "read_case",
    "read_vtu",
    "vectors_of",
]

CASES = Path(__file__).parent / "cases"
ORACLE = ("fx", "fy", "fz", "kn", "energy", "force_error", "stiffness_error", "energy_error")
GOING_IN = 0.5, 20  # radii from which a closed path is come to, and places on the way


class JudgeError(Exception):
    """A case or a method that can't be judged: what is wrong, why, and what to do."""

    def __init__(self, what: str, why: str = "", fix: str = "") -> None:
        super().__init__("\n".join(line for line in (what, why, fix) if line))
        self.what, self.why, self.fix = what, why, fix


@dataclass(frozen=True, eq=False)
class Case:
    """A body, the ball that presses it, and the forces of the oracle.

    `places` (n, 3), `normals` (n, 3), `depths` and `paths` (n,) belong to the presses, in their order; `force` (n, 3),
    `stiffness` and `energy` (n,) are the oracle's, and the three errors (n,) its own. `loops` maps the number of each
    closed path to its corners (m, 3). `description` is case.toml.
    """

    folder: Path
    description: dict[str, Any]
    presses: list[int]
    paths: np.ndarray
    places: np.ndarray
    normals: np.ndarray
    depths: np.ndarray
    force: np.ndarray
    stiffness: np.ndarray
    energy: np.ndarray
    force_error: np.ndarray
    stiffness_error: np.ndarray
    energy_error: np.ndarray
    loops: dict[int, np.ndarray]

    @property
    def name(self) -> str:
        """The folder's name."""
        return self.folder.name

    @property
    def radius(self) -> float:
        """Radius of the ball, m."""
        return float(self.description["ball"]["radius"])

    @property
    def materials(self) -> dict[str, dict[str, Any]]:
        """The tables [materials.LABEL] of case.toml, in their order."""
        return dict(self.description["materials"])

    @cached_property
    def mesh(self) -> dict[str, np.ndarray]:
        """The mesh that a method may use: points (p, 3), tetrahedra (t, 4), label (t,), fixed (p,)."""
        return read_vtu(self.folder / "mesh.vtu")

    def only(self, presses: Sequence[int]) -> Case:
        """Return the case with some of its presses alone."""
        rows = order_of(np.array(presses), np.array(self.presses), self.folder / "presses.csv")
        names = ("paths", "places", "normals", "depths", "force", "stiffness", "energy")
        errors = ("force_error", "stiffness_error", "energy_error")
        chosen = {name: getattr(self, name)[rows] for name in names + errors}
        return replace(self, presses=list(presses), **chosen)

    def shift(self, share: float) -> np.ndarray:
        """Return the presses' places (n, 3) for depths that are larger by a share."""
        return np.asarray(self.places - self.normals * (share * self.depths)[:, None])

    def way_in(self, loop: int) -> np.ndarray:
        """Return places (m, 3) from outside to a closed path, along the normal of the press nearest."""
        first = self.loops[loop][0]
        normal = self.normals[np.argmin(np.linalg.norm(self.places - first, axis=1))]
        return np.asarray(first + np.outer(np.linspace(GOING_IN[0] * self.radius, 0.0, GOING_IN[1]), normal))

    def around(self, loop: int) -> np.ndarray:
        """Return the corners of a closed path and the middles of its sides in turn, ending where it began."""
        corners = self.loops[loop]
        middles = 0.5 * (corners + np.roll(corners, -1, axis=0))
        return np.concatenate([np.stack([corners, middles], 1).reshape(-1, 3), corners[:1]])


def case_names(folder: Path = CASES) -> list[str]:
    """Return the names of the cases in a folder that have an oracle."""
    return sorted(path.parent.name for path in folder.glob("*/oracle.csv"))


def read_case(name: str, folder: Path = CASES, *, blind: bool = False) -> Case:
    """Read a case with the presses that its oracle has.

    A blind one has all presses, and not-a-number for the oracle's values.
    """
    place = folder / name
    if not (place / ("presses.csv" if blind else "oracle.csv")).is_file():
        names = ", ".join(case_names(folder))
        raise JudgeError(f"There is no case {name!r}.", fix=f"Cases are {names or 'missing'}.")
    presses = columns_of(place / "presses.csv")
    if blind:
        unknown = np.full(len(presses["press"]), np.nan)
        oracle = dict.fromkeys(ORACLE, unknown) | {"press": presses["press"]}
    else:
        oracle = columns_of(place / "oracle.csv")
    solved = np.isin(presses["press"], oracle["press"])
    presses = {key: values[solved] for key, values in presses.items()}
    order = order_of(presses["press"], oracle["press"], place / "oracle.csv")
    return Case(
        place,
        tomllib.loads((place / "case.toml").read_text("utf-8")),
        [int(press) for press in presses["press"]],
        presses["path"].astype(int),
        *(vectors_of(presses, names) for names in ("x y z", "nx ny nz")),
        presses["depth"],
        vectors_of(oracle, "fx fy fz")[order],
        *(oracle[key][order] for key in ORACLE[3:]),
        _loops(place / "loops.csv"),
    )


def _loops(path: Path) -> dict[int, np.ndarray]:
    rows = columns_of(path)
    loops = {}
    for loop in np.unique(rows["loop"]).astype(int):
        places = vectors_of(rows, "x y z")[rows["loop"] == loop]
        loops[int(loop)] = places[:-1] if np.allclose(places[0], places[-1]) else places
    return loops


def columns_of(path: Path) -> dict[str, np.ndarray]:
    """Read the numbers of a CSV file by the names of its columns."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    except (OSError, UnicodeError) as error:
        raise JudgeError(f"{path} can't be read.", why=str(error)) from error
    if not rows:
        raise JudgeError(f"{path} has no rows.", fix="Give a header and a row for each press.")
    if any(None in row or None in row.values() for row in rows):
        raise JudgeError(
            f"{path} has a row of another length than its header.", fix="Give each column a value."
        )
    try:
        return {key.strip(): np.array([float(row[key]) for row in rows]) for key in rows[0]}
    except (TypeError, ValueError) as error:
        raise JudgeError(f"{path} holds something that is no number.", why=str(error)) from error


def vectors_of(columns: dict[str, np.ndarray], names: str) -> np.ndarray:
    """Return columns, named with spaces between, side by side."""
    return np.stack([columns[name] for name in names.split()], axis=1)


def order_of(presses: np.ndarray, own: np.ndarray, path: Path) -> list[int]:
    """Return the rows of a file in the order of the presses."""
    if not np.isfinite(own).all():
        raise JudgeError(f"{path} has a press that is no number.", fix="Number presses as presses.csv does.")
    rows = {int(press): row for row, press in enumerate(own)}
    if len(rows) < len(own):
        raise JudgeError(f"{path} has several rows for one press.", fix="Give one row for each press.")
    missing = [int(press) for press in presses if int(press) not in rows]
    if missing:
        raise JudgeError(
            f"{path} lacks {len(missing)} of {len(presses)} presses, among them {missing[0]}.",
            fix="Give a row for each press of presses.csv; nan where the method has no answer.",
        )
    return [rows[int(press)] for press in presses]


def read_vtu(path: Path) -> dict[str, np.ndarray]:
    """Read points, tetrahedra, label and fixed of a VTU file with text arrays, or meshio's compressed ones."""
    from xml.etree import ElementTree

    try:
        root = ElementTree.parse(path).getroot()  # files of the benchmark itself
        arrays = {array.get("Name") or "Points": _vtu_array(array, root) for array in root.iter("DataArray")}
        points, corners = arrays["Points"].reshape(-1, 3), arrays["connectivity"].reshape(-1, 4)
        label, fixed = arrays["label"], arrays["fixed"]
    except (OSError, ElementTree.ParseError, KeyError, ValueError) as error:
        raise JudgeError(f"{path} can't be read as a mesh of tetrahedra.", why=repr(error)) from error
    return {
        "points": points.astype(float),
        "tetrahedra": corners.astype(int),
        "label": label.astype(int),
        "fixed": fixed.astype(bool),
    }


def _vtu_array(array: Any, root: Any) -> np.ndarray:
    kind = np.dtype(array.get("type", "Float64").lower())
    text = (array.text or "").strip()
    if array.get("format") == "ascii":
        return np.array(text.split(), dtype=kind)
    import base64
    import zlib

    head = np.dtype(root.get("header_type", "UInt32").lower())
    if not root.get("compressor"):
        return np.frombuffer(base64.b64decode(text)[head.itemsize :], kind)
    count = int(np.frombuffer(base64.b64decode(text[:16]), head)[0])  # blocks
    size = len(base64.b64encode(bytes((3 + count) * head.itemsize)))
    lengths = np.frombuffer(base64.b64decode(text[:size]), head)[3:]
    data, blocks, start = base64.b64decode(text[size:]), [], 0
    for length in lengths:
        blocks.append(zlib.decompress(data[start : start + int(length)]))
        start += int(length)
    return np.frombuffer(b"".join(blocks), kind)
