"""The page on soft bodies: its own material runs as it stands there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

PAGE = (Path(__file__).parents[3] / "docs" / "guide" / "solids.md").read_text(encoding="utf-8")


@pytest.mark.full
def test_a_material_of_ones_own_runs(capsys: pytest.CaptureFixture):
    program = re.search(r"## A material of one's own\n.*?```python\n(.*?)```", PAGE, re.DOTALL)[1]
    names: dict = {"__name__": "page"}
    exec(compile("import palpate as pp\n" + program, "solids.md", "exec"), names)
    assert names["gent"].shear_modulus == pytest.approx(3e3, rel=1e-6)
    solved = names["stiffening"].solve([-0.006])
    assert solved.converged
    # between a bar with free sides, softened a little by its own compression, and one that can't bulge at all
    stretch, area = 1 - 6 / 30, 0.06**2
    free, confined = 3e3 * (stretch**-2 - stretch) * area, (90e3 + 4 * 3e3) * (1 - stretch) * area
    assert 0.95 * free < solved.response[0] < confined
    assert "gent" in capsys.readouterr().out
