"""The pictures of docs/benchmarks/solves.md that belong to touching, from what the benchmarks wrote as JSON.

python -m benchmarks --only touching_cost touching_mesh --json > figures.json
python -m benchmarks.touching_plots figures.json docs/images
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

__all__ = ["cost", "sizes"]

Rows = Sequence[dict[str, Any]]
FORMS = (("displacement", "o"), ("mixed", "s"))


def cost(rows: Rows, path: Path) -> None:
    """Seconds and memory over unknowns, both axes logarithmic, as a PNG."""
    from matplotlib import pyplot

    figure, (left, right) = pyplot.subplots(1, 2, figsize=(9, 3.8), layout="constrained")
    words = (("sample", "a sample", "--"), ("tangent", "a tangent", "-"), ("residual", "a residual", ":"))
    for (form, marker), colour in zip(FORMS, ("C0", "C1"), strict=True):
        mine = sorted((row for row in rows if row["form"] == form), key=lambda row: row["unknowns"])
        unknowns = [row["unknowns"] for row in mine]
        for key, word, line in words:
            left.loglog(
                unknowns,
                [row[key] for row in mine],
                line,
                marker=marker,
                color=colour,
                label=word,
            )
        right.loglog(unknowns, [row["memory"] for row in mine], marker=marker, color=colour, label=form)
    left.set(xlabel="unknowns", ylabel="CPU seconds, one thread", title="Time")
    right.set(xlabel="unknowns", ylabel="GB", title="Peak memory")
    left.legend(*_first(left, len(words)), loc="lower right", fontsize="small")
    right.legend(fontsize="small")
    for one in (left, right):
        one.set_xticks((5e3, 1e4, 2e4, 4e4, 8e4), ("5 000", "10 000", "20 000", "40 000", "80 000"))
        one.set_xticks((), minor=True)
    right.set_yticks((0.2, 0.5, 1.0), ("0.2", "0.5", "1"))
    right.set_yticks((), minor=True)
    _finish(figure, (left, right), path)


def sizes(rows: Rows, path: Path) -> None:
    """Error of the reaction force over element size for each Poisson's ratio, as a PNG."""
    from matplotlib import pyplot

    poissons = sorted({row["poisson"] for row in rows})
    figure, axes = pyplot.subplots(1, len(poissons), figsize=(9, 3.4), sharey=True, layout="constrained")
    for one, poisson in zip(axes, poissons, strict=True):
        mine = [row for row in rows if row["poisson"] == poisson]
        for form, marker in FORMS:
            one.plot([row["size"] for row in mine], [row[form] for row in mine], marker=marker, label=form)
        one.set(xlabel="element size, mm", title=f"ν = {poisson:g}")
    axes[0].set(ylabel="normal force, N")
    axes[0].legend(fontsize="small")
    _finish(figure, axes, path)


def _first(axes: Any, count: int) -> tuple[list[Any], list[str]]:
    """The legend's entries of the first form: the other's differ in colour only."""
    handles, labels = axes.get_legend_handles_labels()
    return handles[:count], labels[:count]


def _finish(figure: Any, axes: Sequence[Any], path: Path) -> None:
    from matplotlib import pyplot

    for one in axes:
        one.grid(visible=True, which="both", alpha=0.3)
    figure.savefig(path, dpi=100)
    pyplot.close(figure)


def _main(source: str, folder: str) -> int:
    import matplotlib as mpl

    mpl.use("agg")
    found = {
        table["name"]: table["rows"]
        for table in json.loads(Path(source).read_text(encoding="utf-8"))["tables"]
    }
    pictures: dict[str, Callable[[Rows, Path], None]] = {"touching-cost": cost, "touching-sizes": sizes}
    for name in found.keys() & pictures.keys():
        pictures[name](found[name], Path(folder) / f"{name}.png")
    return 0


if __name__ == "__main__":
    sys.exit(_main(*sys.argv[1:]))
