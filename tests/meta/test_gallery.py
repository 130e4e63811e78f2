"""Bodies of the gallery are declared completely, notebooks hold no output, the citation is that of the package."""

from __future__ import annotations

import ast
import importlib.machinery
import importlib.metadata
import importlib.util
import json
import re
import shlex
import tomllib
from pathlib import Path
from types import ModuleType

import pytest
import yaml

from palpate.study import Study

ROOT = Path(__file__).parents[2]
BODIES = tomllib.loads((ROOT / "docs" / "gallery" / "bodies.toml").read_text(encoding="utf-8"))["body"]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))


@pytest.mark.parametrize("body", BODIES, ids=lambda body: body["name"])
def test_a_body_says_how_its_page_is_made(body: dict):
    assert {"name", "title", "about", "page", "commands"} <= set(body)
    assert set(body) <= {"name", "title", "about", "page", "commands", "study", "quick", "missing"}
    calls = [shlex.split(command) for command in body["commands"]]
    assert all(call[0] == "palpate" for call in calls)
    assert calls[-1][:3] == ["palpate", "export", "html"]
    assert body["page"] == Path(calls[-1][3]).stem + "-page.html"
    if "study" in body:
        assert Study.model_validate(tomllib.loads(body["study"])).name == Path(calls[-1][3]).stem


def test_there_are_eight_bodies_and_two_are_quick():
    assert len({body["name"] for body in BODIES}) == 8
    assert sum(body.get("quick", False) and "missing" not in body for body in BODIES) == 2


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_without_output(notebook: Path):
    content = json.loads(notebook.read_text(encoding="utf-8"))
    assert set(content["metadata"]) == {"kernelspec", "language_info"}
    for cell in content["cells"]:
        text = "".join(cell["source"])
        assert not re.search(r"/(home|root|Users|tmp|work)/|[A-Z]:\\\\", text)
        assert cell["metadata"] == {}
        if cell["cell_type"] == "code":
            assert cell["outputs"] == []
            assert cell["execution_count"] is None
            ast.parse(re.sub(r"^%.*$", "", text, flags=re.MULTILINE))


def test_there_are_five_notebooks():
    assert len(NOTEBOOKS) == 5


def test_the_citation_is_complete():
    """What the schema of CFF 1.2.0 asks for; a version that is the package's."""
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert cited["cff-version"] == "1.2.0"
    assert {"message", "title", "authors"} <= set(cited)
    assert cited["version"] == importlib.metadata.version("palpate")
    for work in (cited, *cited["references"]):
        assert work["title"]
        for author in work["authors"]:
            assert "name" in author or {"family-names", "given-names"} <= set(author)
    for reference in cited["references"]:
        assert reference["type"] in {"article", "conference-paper"}
        assert isinstance(reference["year"], int)


@pytest.fixture(scope="module")
def build() -> ModuleType:
    """The script docs/build, which has no ending."""
    loader = importlib.machinery.SourceFileLoader("docs_build", str(ROOT / "docs" / "build"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("docs_build", loader))
    loader.exec_module(module)
    return module


def test_a_page_is_made_anew_only_of_other_content(build: ModuleType, tmp_path: Path):
    made = []

    def make(folder: Path) -> None:
        made.append(list(folder.iterdir()))
        (folder / "page.html").write_text("page", encoding="utf-8")

    for content in ("first", "first", "second", "second"):
        assert build._is_made(tmp_path / "body", "page.html", content, make)
    assert made == [[], []]


def test_what_failed_is_tried_again(build: ModuleType, tmp_path: Path):
    def fail(folder: Path) -> None:
        (folder / "page.html").write_text("half a page", encoding="utf-8")
        raise RuntimeError("no")

    assert not build._is_made(tmp_path / "body", "page.html", "content", fail)
    assert not build._is_made(tmp_path / "body", "page.html", "content", fail)
