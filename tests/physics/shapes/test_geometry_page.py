"""The page on shapes: its programs run, its table is that of the code."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pytest

import palpate.physics.shapes as package

PAGE = (Path(__file__).parents[3] / "docs" / "guide" / "geometry.md").read_text(encoding="utf-8")


@pytest.mark.full
def test_the_programs_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture):
    monkeypatch.chdir(tmp_path)
    exec("\n".join(re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)), {"__name__": "page"})
    assert "('top', 'bottom', 'x_min', 'x_max', 'y_min', 'y_max') ('body',)" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["Block", "Cylinder", "Tube", "LayeredBlock", "Dome", "Organ"])
def test_the_table_names_surfaces_and_arguments(name: str):
    row = re.search(rf"^\| `{name}` \| (.*) \| (.*) \| .* \|$", PAGE, re.MULTILINE)
    shape = getattr(package, name)()
    assert tuple(re.findall(r"`(\w+)`", row[2].partition(";")[0])) == shape.surfaces
    fields = {field.name for field in dataclasses.fields(shape)} - {"element"}
    assert set(re.findall(r"`(\w+)`", row[1])) == fields
