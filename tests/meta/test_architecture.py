"""The architecture page says what is: its folders exist, its layers are those of the contract, its counts are right."""

from __future__ import annotations

import importlib.util
import re
import tomllib

import pytest
from sources import ROOT
from test_readme import code, exists

PAGE = (ROOT / "docs" / "concepts" / "architecture.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def counts():
    """The script that renews the counts."""
    spec = importlib.util.spec_from_file_location("house_counts", ROOT / "docs" / "house_counts.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_folder_exists():
    folders = set(re.findall(r"(?<![\w./-])(\w+)/(?=[\s,;:]|$)", code(PAGE), re.MULTILINE))
    assert len(folders) > 20
    assert {folder for folder in folders if not exists(folder)} == set()


def test_it_has_the_layers_of_the_contract():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = project["tool"]["importlinter"]["contracts"]
    layers = next(contract["layers"] for contract in contracts if contract["type"] == "layers")
    assert "".join(f"    {layer.replace('palpate.', '')}\n" for layer in layers) in PAGE


@pytest.mark.full
def test_counts_are_those_of_the_sources(counts):
    """Packages to 3 % and a hundred lines, so that not each small change renews the page; files to 10 % and ten."""
    stated = list(counts.counted(PAGE))
    assert {"Python", "TypeScript", "physics", "runtime/loop.py"} <= {name for name, _, _ in stated}
    slack = {name: (10 + 0.1 * true if "/" in name else 100 + 0.03 * true) for name, _, true in stated}
    wrong = {name: (page, true) for name, page, true in stated if abs(page - true) > slack[name]}
    assert wrong == {}, "run python docs/house_counts.py"


def test_a_wrong_count_is_noticed_and_renewed(counts):
    spoilt = re.sub(r"^(\| `physics` \| )[\d,]+", r"\g<1>1", PAGE, flags=re.MULTILINE)
    named = {name: (page, true) for name, page, true in counts.counted(spoilt)}
    assert named["physics"][0] == 1 < named["physics"][1]
    renewed = {name: page for name, page, _ in counts.counted(counts.renewed(spoilt))}
    assert renewed["physics"] == round(named["physics"][1], -2)
    without = "".join(line for line in PAGE.splitlines(True) if not line.startswith("| `physics`"))
    assert ("physics", 0) in {(name, page) for name, page, _ in counts.counted(without)}
