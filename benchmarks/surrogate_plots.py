"""Error against the number of solves, a panel for each study, from what the benchmark wrote as JSON.

python -m benchmarks --only surrogates --json > figures.json
python -m benchmarks.surrogate_plots figures.json docs/images/surrogates.png
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.surrogate_measure import OURS, SIZES, SPRINGS
from benchmarks.touch_studies import STUDIES

__all__ = ["curves"]

MARKERS = "osD^vP"
ACROSS = 3
Table = dict[str, Any]


def curves(tables: Mapping[str, Table], path: Path) -> None:
    """The 95th percentile of the force error of every method, study by study, as a PNG.

    Parameters
    ----------
    tables : mapping of name to table
        As plain data, of one run or of several; those that are no curves are passed over but for the springs.
    path : Path
    """
    import matplotlib as mpl

    mpl.use("agg")
    from matplotlib import pyplot

    names = [name for name in STUDIES if _of(name, "-curve") in tables]
    down = math.ceil(len(names) / ACROSS)
    figure, grid = pyplot.subplots(
        down,
        ACROSS,
        figsize=(10.5, 2.9 * down),
        layout="constrained",
        squeeze=False,
        sharex=True,
        sharey=True,
    )
    lines: dict[str, Any] = {}
    for name, axis in zip(names, grid.flat, strict=False):
        beside = tables.get(_of(name, "-rivals"), {"rows": []})["rows"]
        lines |= _panel(axis, name, tables[_of(name, "-curve")]["rows"], beside)
    spare = list(grid.flat)[len(names) :]
    for axis in spare:
        axis.axis("off")
    for axis in grid.flat:
        axis.tick_params(labelbottom=True)
    place = {"handles": list(lines.values()), "labels": list(lines), "fontsize": "small"}
    if spare:
        spare[0].legend(**place, loc="center", frameon=False)
    else:
        figure.legend(**place, loc="outside lower center", ncols=4)
    figure.savefig(path, dpi=90)
    pyplot.close(figure)


def _of(study: str, kind: str) -> str:
    return f"surrogates-{study}{kind}"


def _panel(axis: Any, name: str, rows: Sequence[Table], beside: Sequence[Table]) -> dict[str, Any]:
    """One study; its lines by name."""
    from matplotlib.ticker import LogLocator

    lines = {}
    for row, marker in zip(rows, MARKERS, strict=False):
        sizes = sorted(int(k.removesuffix("_p95")) for k in row if k.endswith("_p95"))
        look: Table = {"color": "black", "linewidth": 2.2, "zorder": 3} if row["method"] == OURS else {}
        errors = [100 * row[f"{n}_p95"] for n in sizes]
        (lines[row["method"]],) = axis.loglog(
            sizes, errors, **{"marker": marker, "markersize": 4, "linewidth": 1.2, **look}
        )
    for row in beside:
        if row["method"] == SPRINGS:
            lines[SPRINGS] = axis.axhline(100 * row["p95"], color="grey", linestyle="--")
    study = STUDIES[name]
    (lines["asked"],) = axis.plot(
        study.wanted, 100 * study.target[1], "*", color="red", markersize=11, zorder=4
    )
    axis.set(title=name, xlabel="training solves")
    axis.set_xticks(SIZES, [str(n) for n in SIZES])
    axis.set_xticks((), minor=True)
    axis.set_ylabel("force error, p95, %" if axis.get_subplotspec().is_first_col() else "")
    axis.yaxis.set_major_locator(LogLocator())
    axis.yaxis.set_major_formatter("{x:g}")
    axis.grid(visible=True, which="both", alpha=0.25)
    return lines


def _main(*arguments: str) -> int:
    *sources, picture = arguments
    found = [json.loads(Path(one).read_text(encoding="utf-8"))["tables"] for one in sources]
    curves({table["name"]: table for tables in found for table in tables}, Path(picture))
    return 0


if __name__ == "__main__":
    sys.exit(_main(*sys.argv[1:]))
