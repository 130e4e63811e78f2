"""What the guide to Python says about judging and reporting: its program runs, its limits are those of the code."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from linear_bodies import tip_model
from palpate.study import Study
from palpate.validation import Limits
from programs import run_program

GUIDE = (Path(__file__).parents[2] / "docs" / "guide" / "python.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", GUIDE, re.DOTALL)


@pytest.mark.full
@pytest.mark.timeout(240)
def test_the_program_that_writes_a_report_runs(tmp_path: Path) -> None:
    (program,) = (block for block in BLOCKS if "write_report(" in block)
    printed = run_program(program, tmp_path, 200)
    assert "body on 16 unseen solves: every limit kept" in printed
    assert "A cantilever of nylon (E = 2 GPa)" in (tmp_path / "beam.html").read_text(
        encoding="utf-8"
    ).replace("\N{NO-BREAK SPACE}", " ")


def test_a_model_is_asked_as_the_guide_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import palpate as pp

    (asking,) = (block for block in BLOCKS if 'pp.load("beam.palpate")' in block)
    tip_model().save(tmp_path / "beam.palpate")
    monkeypatch.chdir(tmp_path)
    names = {"pp": pp}
    exec(asking, names)
    # 0.05 m/N at the tip
    assert names["answer"].force == pytest.approx([0.0, 0.4, 0.0])
    field = names["touch"].fields["displacement"]
    assert np.array_equal(field.values(np.array([[9.0]])), field.values(np.array([[5.0]])))


def test_the_defaults_of_both_kinds_of_limits_are_those_of_the_table() -> None:
    rows = dict(re.findall(r"^\| (`(?:rmse|filter|force)[^|]*?) \| (.*) \|$", GUIDE, re.MULTILINE))
    assert len(rows) == 4
    for keys, cells in rows.items():
        columns = [cell.split(", ") for cell in cells.split(" | ")]
        for i, key in enumerate(re.findall(r"`(\w+)`", keys)):
            python, study = (column[min(i, len(column) - 1)] for column in columns)
            assert figure(python) == getattr(Limits(), key)
            assert figure(study) == getattr(Study().target, key)


def figure(text: str) -> float | None:
    if text == "not asked":
        return None
    return float(text.removesuffix(" %")) / 100 if text.endswith("%") else float(text)
