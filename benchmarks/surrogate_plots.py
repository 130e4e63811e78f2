"""Curves of error against the number of solves, from what the benchmark wrote as JSON.

python -m benchmarks --only surrogates --json > figures.json
python -m benchmarks.surrogate_plots figures.json docs/images
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

__all__ = ["curves"]

MARKERS = "osD^vP"


def curves(rows: list[dict[str, Any]], springs: dict[str, Any] | None, title: str, path: Path) -> None:
    """Median and 95th percentile of the force error of every method, as a PNG.

    Parameters
    ----------
    rows : list of mappings
        Of the curve's table.
    springs : mapping, optional
        The row of springs, which do not improve with more solves.
    title : str
    path : Path
    """
    from matplotlib import pyplot
    from matplotlib.ticker import LogLocator

    figure, axes = pyplot.subplots(1, 2, figsize=(8.4, 3.4), sharex=True, layout="constrained")
    for axis, key, name in zip(axes, ("median", "p95"), ("median", "95th percentile"), strict=True):
        for row, marker in zip(rows, MARKERS, strict=False):
            sizes = sorted(int(k.removesuffix(f"_{key}")) for k in row if k.endswith(f"_{key}"))
            ours = row["method"] == "palpate"
            axis.loglog(
                sizes,
                [100 * row[f"{n}_{key}"] for n in sizes],
                marker=marker,
                markersize=4,
                color="black" if ours else None,
                linewidth=2.2 if ours else 1.2,
                label=row["method"],
            )
        if springs is not None:
            axis.axhline(100 * springs[key], color="grey", linestyle="--", label=springs["method"])
        axis.set(xlabel="training solves", ylabel="force error, %", title=f"{title}: {name}")
        axis.set_xticks(sizes, [str(n) for n in sizes])
        axis.set_xticks((), minor=True)
        axis.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.yaxis.set_major_formatter("{x:g}")
        axis.yaxis.set_minor_formatter("")
        axis.grid(visible=True, which="both", alpha=0.3)
    axes[1].legend(fontsize="x-small")
    figure.savefig(path, dpi=80)
    pyplot.close(figure)


def _main(source: str, folder: str) -> int:
    import matplotlib as mpl

    mpl.use("agg")
    tables = {t["name"]: t for t in json.loads(Path(source).read_text(encoding="utf-8"))["tables"]}
    for name, table in tables.items():
        if name.endswith("-curve"):
            study = name.removeprefix("surrogates-").removesuffix("-curve")
            beside = tables.get(f"surrogates-{study}-rivals", {"rows": []})["rows"]
            springs = next((r for r in beside if r["method"].startswith("mass")), None)
            curves(table["rows"], springs, study, Path(folder) / f"surrogates-{study}.png")
    return 0


if __name__ == "__main__":
    sys.exit(_main(*sys.argv[1:]))
