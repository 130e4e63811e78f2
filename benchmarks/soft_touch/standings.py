"""The standings of soft-touch: figures of all methods whose answers are kept, beside each other.

Answers lie in `answers/METHOD.json` (`ask_methods.py`); they are compared with the oracle's tables anew each time.
NumPy is enough; the picture needs Matplotlib.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

if __package__:
    from .case_files import CASES, Case, case_names, read_case
    from .judge import FIGURES, compare, figure_text
else:  # beside judge.py as a file
    from case_files import CASES, Case, case_names, read_case
    from judge import FIGURES, compare, figure_text

__all__ = ["ANSWERS", "METHODS", "best_row", "draw", "sources", "standings", "standings_text", "sweep_rows"]

ANSWERS = Path(__file__).parent / "answers"
WORST = 10.0  # JND, at which the picture ends
METHODS = {
    "palpate_surrogate": "palpate's surrogate",
    "force_rbf": "RBF on forces (SciPy)",
    "mujoco_flex": "MuJoCo flex",
    "newton_vbd": "Newton VBD",
    "mass_spring": "springs and points",
}
"""Files of `methods` and their names in tables."""


def standings(
    cases: list[str], further: dict[str, dict[str, dict[str, Any]]] | None = None
) -> list[dict[str, Any]]:
    """Return a row for each case and method, the nearest first: case, method, settings, and the judge's figures.

    `further` maps names of other methods to their figures by case.
    """
    rows = []
    for name in cases:
        case = read_case(name, CASES)
        own = []
        for method, title in METHODS.items():
            kept = _kept(method)["cases"].get(name)
            if kept is not None:
                answers = kept.get("best") or best_row(kept["sweep"], case)
                own.append(
                    {"case": name, "method": title, "settings": answers["settings"], **compare(answers, case)}
                )
        for title, figures in (further or {}).items():
            if name in figures:
                own.append({"case": name, "method": title, "settings": "", **figures[name]})
        rows += sorted(own, key=_error)
    return rows


def best_row(sweep: list[dict[str, Any]], case: Case) -> dict[str, Any]:
    """Return the row of a sweep whose median force error is least; it has no more than forces."""
    return min(sweep, key=lambda row: _error(compare(row, case)))


def _error(figures: dict[str, Any]) -> float:
    error = figures["jnd_median"]
    return math.inf if error is None else float(error)


def standings_text(rows: list[dict[str, Any]]) -> str:
    """Return rows as a table of text, a block for each case."""
    heads = ["", *FIGURES.values()]
    lines = [[row["method"], *(figure_text(row[key]) for key in FIGURES)] for row in rows]
    widths = [max(map(len, column)) for column in zip(heads, *lines, strict=True)]

    def line(cells: list[str]) -> str:
        pairs = list(zip(cells, widths, strict=True))
        return "  ".join([pairs[0][0].ljust(pairs[0][1]), *(cell.rjust(width) for cell, width in pairs[1:])])

    text, case = [], None
    for row, cells in zip(rows, lines, strict=True):
        if row["case"] != case:
            case = row["case"]
            text += ["", case, line(heads)]
        text.append(line(cells))
    return "\n".join(text[1:])


def sweep_rows() -> list[dict[str, Any]]:
    """Return a row for each setting of each method on each case that has an oracle, in the order of the sweep."""
    rows = []
    for method, title in METHODS.items():
        for name, kept in _kept(method)["cases"].items():
            if name in case_names():
                case = read_case(name, CASES)
                for row in kept["sweep"]:
                    words = {
                        "method": title,
                        "case": name,
                        "settings": row["settings"],
                        "seconds": row["seconds"],
                    }
                    rows.append(compare(row, case) | words)
    return rows


def sources() -> dict[str, str]:
    """Return by the methods' titles the versions and the machine that their answers come from."""
    lines = {}
    for method, title in METHODS.items():
        kept = _kept(method)
        if kept["cases"]:
            own = kept["machine"].split("; ")[:2]  # date and processor
            lines[title] = "; ".join(filter(None, (kept["versions"], *own)))
    return lines


def _kept(method: str) -> dict[str, Any]:
    path = ANSWERS / f"{method}.json"
    empty: dict[str, Any] = {"cases": {}, "versions": "", "machine": ""}
    return json.loads(path.read_text("utf-8")) if path.exists() else empty


def draw(rows: list[dict[str, Any]]) -> Any:
    """Return a figure of the force error of each method in just noticeable differences, a panel for each case."""
    from matplotlib.figure import Figure

    cases = list(dict.fromkeys(row["case"] for row in rows))
    titles = list(dict.fromkeys(row["method"] for row in rows))[::-1]
    figure = Figure(figsize=(1.8 * len(cases) + 2.2, 0.35 * len(titles) + 1.2), layout="constrained")
    panels = figure.subplots(1, len(cases), sharex=True, sharey=True, squeeze=False)[0]
    longest = 0.0
    for panel, case in zip(panels, cases, strict=True):
        for row in rows:
            if row["case"] == case and row["jnd_median"] is not None:
                place = titles.index(row["method"])
                ends = [min(row[key], WORST) for key in ("jnd_median", "jnd_p95")]
                longest = max(longest, *ends)
                panel.plot(ends, [place, place], color="C0", linewidth=2.0)
                panel.plot(ends[:1], [place], "o", color="C0")
        panel.axvline(1.0, color="0.4", linewidth=0.8, linestyle="--")
        panel.set(title=case)
    panels[0].set_xlim(0.0, 1.05 * max(longest, 1.0))
    panels[0].set_yticks(range(len(titles)), titles)
    panels[0].set_ylim(-0.5, len(titles) - 0.5)
    figure.supxlabel("force error, JND: median to 95th percentile", fontsize=9)
    return figure
