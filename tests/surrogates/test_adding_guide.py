"""The guide's pages on new kinds show the code of tests that run it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

HERE = Path(__file__).parent
GUIDE = HERE.parents[1] / "docs" / "guide"


@pytest.mark.parametrize(
    ("page", "test"), [("adding-a-baseline", "test_new_kind"), ("adding-a-memory", "test_new_memory")]
)
def test_a_page_shows_what_a_test_runs(page, test):
    code = (HERE / f"{test}.py").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", (GUIDE / f"{page}.md").read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) == 2
    assert all(block in code for block in blocks)
