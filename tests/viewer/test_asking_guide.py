"""What the guide says about asking a pressed body runs, and means what it says."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from slabs import DEVIATION, touched_slab

import palpate as pp

GUIDE = (Path(__file__).parents[2] / "docs" / "guide" / "python.md").read_text(encoding="utf-8")


def test_a_pressed_body_is_asked_as_the_guide_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (asking,) = (b for b in re.findall(r"```python\n(.*?)```", GUIDE, re.DOTALL) if "body = pp.load" in b)
    touched_slab().save(tmp_path / "block.palpate")
    monkeypatch.chdir(tmp_path)
    # the guide's block is 50 mm high, the slab's top lies at zero and its middle too; grazing is lifted off it
    asking = asking.replace("0.05, 0.05, 0.055", "0.0, 0.0, 0.005").replace(
        "0.05, 0.05, 0.06", "0.0, 0.0, 0.0101"
    )
    names = {"pp": pp}
    exec(asking, names)
    touch, answer, X = names["touch"], names["answer"], names["X"]
    np.testing.assert_allclose(touch.depth(X), [0.005, -1e-4], atol=1e-9)
    np.testing.assert_array_equal(touch.force(X)[1], np.zeros(3))
    np.testing.assert_allclose(answer.force, touch.force(X)[0])
    np.testing.assert_allclose(answer.stiffness, touch.stiffness(X)[0])
    assert answer.inside == touch.inside(X)[0]
    assert touch.deviation(X)[0] == pytest.approx(DEVIATION)
    assert names["body"].fields["displacement"].values(X).shape[::2] == (2, 3)
