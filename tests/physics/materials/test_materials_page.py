"""The page on materials: its code runs, and its tables name what exists."""

from __future__ import annotations

import re
from pathlib import Path

from palpate.physics.materials import MATERIALS
from palpate.physics.materials.tissues import TISSUES

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


def test_its_table_of_tissues_is_the_one_of_the_code():
    rows = re.findall(r"^\| (\w+) \| ([\d.]+) \| ([\d.]+) to ([\d.]+) \| .* \| (.*) \|$", PAGE, re.MULTILINE)
    assert [row[0] for row in rows] == list(TISSUES)
    for name, *numbers, sources in rows:
        tissue = TISSUES[name]
        assert [1e3 * float(n) for n in numbers] == [tissue.young, tissue.low, tissue.high]
        authors = [re.match(r".*? \d{4}", source)[0] for source in tissue.sources]
        assert sources == "; ".join(authors)
        for author in authors:
            assert PAGE.count(author.split(" ")[0].rstrip(",")) > 1, "its full source stands below the table"
