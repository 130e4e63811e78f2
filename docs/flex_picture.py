"""Draws the error of MuJoCo's flex and of a learnt body over their time: python docs/flex_picture.py.

The figures are those of the record ``mujoco_flex``, which `python -m benchmarks.mujoco_flex --record` renews.
"""

from __future__ import annotations

import json
from pathlib import Path

from matplotlib import pyplot

DOCS = Path(__file__).parent
RECORD = DOCS.parent / "benchmarks" / "records" / "mujoco_flex.json"
PICTURE = DOCS / "images" / "mujoco-flex.svg"


def main() -> None:
    """Read the record and write the picture."""
    rows = json.loads(RECORD.read_text("utf-8"))["rows"]
    figure, axes = pyplot.subplots(figsize=(7, 4), layout="constrained")
    for words, marker in (("palpate", "o"), ("flex, grid", "s"), ("flex, graded", "^")):
        own = [row for row in rows if row[0].startswith(words) and row[3] != "–"]
        label = "palpate, learnt from 14 solves" if words == "palpate" else words
        axes.plot([float(r[5]) for r in own], [abs(float(r[3])) for r in own], marker, ls="", label=label)
    axes.set(xscale="log", yscale="log", xlabel="processor time over time of the scene")
    axes.set(ylabel="error of the rest depth, %")
    axes.axvline(1.0, color="0.6", lw=0.8)
    axes.legend()
    figure.savefig(PICTURE, metadata={"Date": None})


if __name__ == "__main__":
    main()
