"""From another solver's table to answers: import, learn, ask, validate and export of curves and numbers."""

from __future__ import annotations

import json

import numpy as np
import pytest

from answering import RANGES, TIMES, answers

MAPPING = """
name = "rod"
axis = "time"
inputs = [{ name = "heat" }, { name = "conductivity" }]
outputs = [{ name = "rise", from = "T" }, { name = "final", from = "T", reduce = "max" }]
"""


@pytest.mark.full
def test_a_table_of_curves_goes_all_the_way(palpate, tmp_path):
    low, high = np.array([[r.low, r.high] for r in RANGES]).T
    X = np.random.default_rng(0).uniform(low, high, (60, 2))
    X[:4] = [(low[0], low[1]), (low[0], high[1]), (high[0], low[1]), (high[0], high[1])]
    rows = ["heat [W/m³],conductivity [W/(m K)],time [s],T [K]"]
    for x, rise in zip(X, answers(X)["rise"], strict=True):
        rows += [f"{x[0]:.17g},{x[1]:.17g},{t:.17g},{T:.17g}" for t, T in zip(TIMES, rise, strict=True)]
    table, mapping = tmp_path / "rod.csv", tmp_path / "rod.toml"
    table.write_text("\n".join([*rows, ""]), encoding="utf-8")
    mapping.write_text(MAPPING, encoding="utf-8")
    data, file = tmp_path / "rod.zarr", tmp_path / "rod.palpate"
    made = palpate("dataset", "import", table, "--mapping", mapping, "--test", "0.5", "--out", data)
    assert made.code == 0, made.err
    assert palpate("learn", data).code == 0
    assert "answers final and the curve rise" in palpate("ask", file).out
    (one,) = json.loads(palpate("ask", file, "--at", "300000,20", "--json").out)["answers"]
    wanted = answers(np.array([[3e5, 20.0]]))["rise"][0]
    assert one["outputs"]["final"] == pytest.approx(wanted[-1], rel=0.02)
    assert one["fields"]["rise"]["largest"] == pytest.approx(wanted[-1], rel=0.02)
    judged = json.loads(palpate("validate", file, "--json").out)
    assert {name["name"]: name["p95"] < 0.01 for name in judged["answers"]} == {"final": True, "rise": True}
    assert "rise, worst case" in file.with_suffix(".html").read_text("utf-8")
    refused = palpate("run", file)
    assert refused.code != 0
    assert "can't be touched" in refused.err
