"""Every export carries the model card, with the hash of the weights that went out."""

from __future__ import annotations

import json
import re
import zipfile
from collections.abc import Callable
from pathlib import Path

import onnx
import pytest

from exported_bodies import body
from palpate.export import export_c, export_fmu
from palpate.export.onnx_export import export_onnx
from palpate.surrogates import Surrogate
from palpate.viewer.file_page import export_html


def _c(thing: Surrogate, folder: Path, **parts: bool) -> tuple[str, str]:
    done = export_c(thing, folder, check=False, **parts)
    assert (folder / f"{done.name}_card.md").read_text("utf-8").startswith("# Model card")
    return (folder / f"{done.name}_card.json").read_text("utf-8"), done.hash


def _fmu(thing: Surrogate, folder: Path) -> tuple[str, str]:
    done = export_fmu(thing, folder / "body.fmu", check=False)
    with zipfile.ZipFile(done.path) as file:
        return file.read("documentation/card.json").decode(), done.hash


def _onnx(thing: Surrogate, folder: Path) -> tuple[str, str]:
    done = export_onnx(thing, folder / "body.onnx", check=False)
    return {p.key: p.value for p in onnx.load(done.file).metadata_props}["card"], done.hash


def _html(thing: Surrogate, folder: Path) -> tuple[str, str]:
    done = export_html(thing, folder / "body.html", check=False)
    found = re.search(r'id="palpate-card">(.*?)</script>', done.file.read_text("utf-8"), re.DOTALL)
    assert found is not None
    return found.group(1), done.hash


@pytest.mark.grid
@pytest.mark.parametrize("export", [_c, _fmu, _onnx, _html])
def test_the_card_goes_out(export: Callable[[Surrogate, Path], tuple[str, str]], tmp_path: Path):
    thing = body("contact").signed(author="A. Author </script>", licence="CC-BY-4.0")
    text, weights = export(thing, tmp_path)
    card = json.loads(text)
    assert (card["author"], card["licence"]) == ("A. Author </script>", "CC-BY-4.0")
    named = {name: value for name, value in card["hashes"].items() if name.startswith("weights")}
    assert list(named.values()) == [weights]
    # whoever couples the body must know that it has no mass
    assert any(limit.startswith("Quasi-static:") and "mass and damping" in limit for limit in card["limits"])


def test_the_card_says_of_which_weights_the_hash_is(tmp_path: Path):
    thing = body("relaxation")
    labels = {}
    for number, parts in enumerate(({}, {"with_field": False}, {"deviation": False, "with_field": False})):
        text, _ = _c(thing, tmp_path / str(number), **parts)
        labels |= json.loads(text)["hashes"]
    assert [name for name in labels if name.startswith("weights")] == [
        "weights with the field displacement",
        "weights without a field",
        "weights without a field, without the deviation",
    ]
    assert len(set(labels.values())) == len(labels)
