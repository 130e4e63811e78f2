"""The tables of presses and closed paths of a case."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path as File
from typing import Any

from .bodies import loops_of, paths_of

__all__ = ["write_places"]


def write_places(name: str, seed: int, folder: File) -> None:
    """Write the presses and loops of a seed."""
    presses: list[list[Any]] = []
    for path in paths_of(name, seed):
        for step, (centre, depth) in enumerate(zip(path.centres, path.depths, strict=True)):
            row = [f"{value:.9f}" for value in (*centre, *path.normal, depth)]
            presses.append([len(presses), path.number, step, *row])
    _write_table(folder / "presses.csv", "press,path,step,x,y,z,nx,ny,nz,depth", presses)
    loops = [
        [loop, index, *(f"{value:.9f}" for value in point)]
        for loop, points in enumerate(loops_of(name, seed))
        for index, point in enumerate(points)
    ]
    _write_table(folder / "loops.csv", "loop,index,x,y,z", loops)


def _write_table(file: File, header: str, rows: Iterable[Sequence[Any]]) -> None:
    """Write a table with commas."""
    with file.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(header.split(","))
        writer.writerows(rows)
