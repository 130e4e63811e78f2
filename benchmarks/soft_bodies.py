"""Soft bodies of simulators and surrogates beside the oracles of soft-touch, and the sweeps in which they were set.

    python -m benchmarks.soft_bodies [--record]

Compares the kept answers of `benchmarks/soft_touch/answers` anew; `python -m benchmarks.soft_touch.ask_methods` asks
for them, and `python -m benchmarks.soft_touch.learn_bodies` learns palpate's surrogates. `--record` draws the picture.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.runner import main
from benchmarks.soft_touch.judge import FIGURES, case_names, figure_text, noticeable, read_case
from benchmarks.soft_touch.standings import draw, sources, standings, sweep_rows
from benchmarks.table import Column, Table, quick_mark
from palpate.validation.report.trace_pictures import save_figure

__all__ = ["tables"]

PICTURE = Path(__file__).parents[1] / "docs" / "images" / "soft-touch.svg"


def tables(*, quick: bool) -> list[Table]:
    """Return the standings and the sweeps."""
    rows = standings(case_names())
    if "--record" in sys.argv and not quick:
        save_figure(PICTURE, lambda: draw(rows))
    notes = (
        "JND: error over what a hand just notices, 7 % of the force, below 1 N 10 %",
        "a rival's setting is the one that comes nearest on two of the paths, for each body by itself; "
        "palpate's is that of the most solves",
        *(_oracle_note(name) for name in case_names()),
        *(f"{title}: {source}" for title, source in sources().items()),
    )
    columns = (
        Column("case", "body"),
        Column("method", "method"),
        *(Column(key, title) for key, title in FIGURES.items()),
        Column("settings", "settings"),
    )
    swept = (
        Column("method", "method"),
        Column("case", "body"),
        Column("settings", "settings"),
        Column("jnd_median", "force, JND"),
        Column("jnd_p95", "95th percentile, JND"),
        Column("presses", "presses answered"),
        Column("seconds", "processor, s"),
    )
    return [
        Table(
            "soft_touch", f"Soft bodies under a ball{quick_mark(quick)}", columns, _texts(rows), notes=notes
        ),
        Table("soft_touch_sweep", f"Settings of each method{quick_mark(quick)}", swept, _texts(sweep_rows())),
    ]


def _oracle_note(name: str) -> str:
    case = read_case(name)
    own = float(np.median(case.force_error / noticeable(case.force)))
    return f"oracle of {name}: {len(case.presses)} presses, whose own error is {own:.2g} JND at the median"


def _texts(rows: list[dict[str, Any]]) -> list[dict[str, str]]:
    return [
        {key: value if isinstance(value, str) else figure_text(value) for key, value in row.items()}
        for row in rows
    ]


if __name__ == "__main__":
    sys.exit(main(only="soft_bodies"))
