"""The page on materials: its code runs, and its tables name what exists."""

from __future__ import annotations

import re
from pathlib import Path

from palpate.physics.materials import MATERIALS

PAGE = (Path(__file__).parents[3] / "docs" / "method" / "materials.md").read_text(encoding="utf-8")


def test_its_code_runs(capsys):
    blocks = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert len(blocks) == 4
    names: dict[str, object] = {"__name__": "page"}
    for block in blocks:
        exec(compile(block, "materials.md", "exec"), names)
    promised = re.search(r"print\(tissue\)  # (.*)", PAGE)[1]
    assert capsys.readouterr().out.strip() == promised


def test_its_table_holds_the_library():
    for name in MATERIALS:
        words = name.removeprefix("ecoflex ").removeprefix("dragon skin ").removesuffix(" neo-hookean")
        assert words in PAGE
