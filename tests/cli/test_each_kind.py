"""One body of each kind on its whole way: solved, learnt, judged, asked, felt in the loop and exported by the commands.

A body that loads move is carried out by `test_commands.py`, whose other tests go on with it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from few_solves import BLOCK, FEW_SOLVES
from palpate.dataset import Dataset
from palpate.learning.loading import load
from palpate.study import preset_study, to_toml


def pressed() -> str:
    """A block of few elements under a ball."""
    return BLOCK + FEW_SOLVES


def held() -> str:
    """A block of few elements held by a glued pad, where it is solved least."""
    study = preset_study("grasp", quick=True)
    few = {
        "sweep": {"samples": 6, "element": 2 * study.interaction.radius, "workers": 1},
        "test": {"samples": 2},
        "learning": {"effort": 0.05, "workers": 1},
    }
    return to_toml(
        study.model_copy(
            update={part: getattr(study, part).model_copy(update=new) for part, new in few.items()}
        )
    )


def remembering() -> str:
    """A rod led past yield, by few histories of a coarse beam."""
    text = to_toml(preset_study("beam-plastic"))
    few = {"elements = 20": "elements = 4", "fibres = 48": "fibres = 8", "histories = 10": "histories = 1"}
    limits = {"unseen = 14": "unseen = 1", "p95 = 0.035": "p95 = 10.0", "median = 0.01": "median = 10.0"}
    for old, new in {**few, **limits, "# tolerance = 1e-05": "tolerance = 1e-3"}.items():
        assert old in text
        text = text.replace(old, new)
    return text


@pytest.mark.parametrize("kind", [pressed, held, remembering])
def test_a_body_goes_the_whole_way(palpate, tmp_path: Path, kind: Callable[[], str], c_compiler: str):
    file, model = tmp_path / "body.toml", tmp_path / "body.palpate"
    file.write_text(
        re.sub("^name = .*", 'name = "body"', kind(), count=1, flags=re.MULTILINE), encoding="utf-8"
    )
    for command in ("sweep", "learn"):
        answer = palpate(command, file)
        assert answer.code == 0, answer.err
    if kind is not remembering:
        assert len(Dataset.open(tmp_path / "body.zarr").ok) >= 6
    judged = palpate("validate", file)
    assert judged.code in {0, 1}, (
        judged.err
    )  # so few solves may miss a limit; how well is for the demos to tell
    assert (tmp_path / "body.html").stat().st_size > 10_000
    body = load(model)
    assert body.energy.network.units >= 0
    felt = palpate("run", model, "--seconds", "0.4", "--json")
    assert felt.code == 0, felt.err
    assert json.loads(felt.out)["largest_force"] > 0
    out = palpate("export", "c", model, "--out", tmp_path / "c")
    assert out.code == 0, out.err
    assert list((tmp_path / "c").glob("*.c"))
