"""Published experiments on sequentially learnt networks, ours beside what the papers report.

hermite        L1  RAN, RAN-EKF and MRAN on a function of one input
mackey_glass   L2  a chaotic series, size against error
plant          L3  an identification task that a linear fit wins
auto_mpg       L4  392 cars (from mlxtend, named where it is missing)
franke         L5  a smooth surface
directions     L6  a surface that wants rotated units

Published figures are recalled from the papers; "re-run elsewhere" is an independent implementation of the same
recipe. Claims are one-sided: equality with a published error would mean nothing.
"""

from __future__ import annotations

from dataclasses import replace

from benchmarks.literature import auto_mpg, directions, franke, hermite, mackey_glass, plant
from benchmarks.table import Table

__all__ = ["tables"]


def tables(*, quick: bool = False) -> list[Table]:
    """All tables; `quick` takes few draws, samples and passes, whatever the titles say."""
    found = [
        hermite.table(quick=quick),
        *mackey_glass.tables(quick=quick),
        plant.table(quick=quick),
        auto_mpg.table(quick=quick),
        franke.table(quick=quick),
        *directions.tables(quick=quick),
    ]
    return [replace(table, title=f"{table.title} (quick)") for table in found] if quick else found
