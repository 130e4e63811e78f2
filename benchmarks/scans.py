"""Solves that a segmented scan takes until the force error is 3 %, with stiffnesses fixed and as inputs.

    python -m benchmarks.scans [--quick] [--json]

The scan is a ball of fat of 20 mm with a stiff ball of 10 mm in it, in voxels of 2 mm, as a labelmap that SimpleITK
writes. Solves are chosen as `palpate touch` chooses them, on elements of 5 mm, and unseen ones judge the surrogate.
Times are those of the wall, beside whatever else the machine does.
"""

from __future__ import annotations

import math
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table, quick_mark
from palpate.study.improve_study import improve_study
from palpate.study.part_study import part_study
from palpate.study.run import Paths

__all__ = ["tables"]

OUTER, INNER, UP, VOXEL = 20.0, 10.0, 5.0, 2.0  # mm: radii, the inner ball above the middle, a voxel
WANTED = 0.03  # relative force error at the 95th percentile of unseen solves
LIMIT = 900.0  # s after which no further batch of solves begins
# a name, materials as they are typed, and the most solves that were wanted
CASES = (
    ("fixed", "fat=3 kPa,lump=30 kPa", 40),
    ("two stiffnesses as inputs", "fat=2 kPa..6 kPa,lump=10 kPa..60 kPa", 120),
)
COLUMNS = [
    Column("case", "stiffnesses"),
    Column("solves", "solves"),
    Column("median", "force error, median", ".2%"),
    Column("p95", "95th percentile", ".2%"),
    Column("first", "first touch, s", ".0f"),
    Column("seconds", "until then, s", ".0f"),
]


def tables(*, quick: bool = False) -> list[Table]:
    """Return the solves until the wanted error, with stiffnesses fixed and as inputs."""
    rows = [
        _improve(*case[:2], most=12 if quick else 2 * case[2], quick=quick)
        for case in CASES[: 1 if quick else 2]
    ]
    claims = [
        Claim(
            f"solves until {WANTED:.0%}, stiffnesses {name}", (float(row["wanted_at"]),), float(most), ".0f"
        )
        for (name, _, most), row in zip(CASES, rows, strict=False)
    ]
    title = f"A ball in a ball as a labelmap, until a force error of {WANTED:.0%}{quick_mark(quick)}"
    return [Table("scans", title, COLUMNS, rows, [] if quick else claims)]


def _improve(case: str, materials: str, *, most: int, quick: bool) -> dict[str, Any]:
    """Return the row of a case: solves are chosen until the error is as wanted, or the most are done."""
    row: dict[str, Any] = {"case": case, "wanted_at": math.inf}
    with tempfile.TemporaryDirectory() as scratch:
        path = write_scan(Path(scratch) / "balls.nrrd")
        choices = {"labels": "fat=1,lump=2", "materials": materials, "element": "5 mm"}
        began = time.monotonic()
        study = part_study(path, radius=0.010, **choices)[0]
        limit = 60.0 if quick else LIMIT
        for step in improve_study(
            study, Paths(path.parent, study.name), until=WANTED, limit=limit, progress=False
        ):
            seconds = time.monotonic() - began
            if step.is_new:
                row.setdefault("first", seconds)
            if step.phase == "judged" and math.isfinite(step.error):
                row |= {"solves": step.solves, "median": step.median, "p95": step.error, "seconds": seconds}
                print(row, file=sys.stderr, flush=True)
                if step.error <= WANTED:
                    row["wanted_at"] = step.solves
            if step.reached or step.solves >= most:
                break
    return row


def write_scan(path: Path) -> Path:
    """Write the ball in a ball as a labelmap."""
    import SimpleITK

    count = math.ceil(2 * OUTER / VOXEL) + 6
    along = (np.arange(count) - count / 2 + 0.5) * VOXEL
    places = np.stack(np.meshgrid(along, along, along, indexing="ij"), axis=-1)
    labels = (np.linalg.norm(places, axis=-1) < OUTER).astype(np.uint8)
    labels[np.linalg.norm(places - [0, 0, UP], axis=-1) < INNER] = 2
    image = SimpleITK.GetImageFromArray(np.ascontiguousarray(labels.T))
    image.SetSpacing([VOXEL] * 3)
    image.SetOrigin([float(along[0])] * 3)
    SimpleITK.WriteImage(image, str(path))
    return path


if __name__ == "__main__":
    raise SystemExit(main(only="scans"))
