"""Names and docstrings read as sentences of an engineer: subjects first, no riddles, none of the terms given up."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from sources import FUNCTIONS, ROOT, files, package_of, tree

pytestmark = pytest.mark.full  # the house's own rules, not what palpate does

CLAUSE = re.compile(r"(What|Whether|How|Of|The same)\b")

# Terms of earlier versions: docs/concepts/glossary.md has those that took their place.
GIVEN_UP = {
    "belief",
    "carrying",
    "comb",
    "committee",
    "crew",
    "dent",
    "dents",
    "dimple",
    "dimples",
    "entered",
    "exhibit",
    "exhibits",
    "foot",
    "footprint",
    "gauge",
    "judged",
    "needle",
    "needles",
    "nudge",
    "nudged",
    "parted",
    "parting",
    "prints",
    "race",
    "relapse",
    "rise",
    "searcher",
    "skins",
    "sought",
    "swept",
    "told",
    "travelling",
    "twin",
    "twins",
}
# A word of everyday English where it is the time in which a load or a press rises to its size.
ALLOWED = {("physics", "rise"), ("learning", "rise")}
GIVEN_UP_CLASSES = {
    "GraspSurrogate",
    "HeldBody",
    "HeldPath",
    "HeldPaths",
    "HeldStudy",
    "TouchModel",
    "TouchStudy",
    "TouchSurrogate",
    "TouchedBody",
}


def documented(file: Path) -> Iterator[tuple[str, ast.AST, str]]:
    """Name, node and docstring of the module, and of each class and function in it."""
    for node in ast.walk(tree(file)):
        if isinstance(node, (*FUNCTIONS, ast.ClassDef, ast.Module)) and (doc := ast.get_docstring(node)):
            yield f"{file}:{getattr(node, 'name', '')}", node, doc


@pytest.mark.parametrize("package", sorted({package_of(file) for file in files()}))
def test_docstrings_begin_with_their_subject(package):
    clauses = [
        f"{where}: {doc.splitlines()[0]}"
        for file in files()
        if package_of(file) == package
        for where, _, doc in documented(file)
        if CLAUSE.match(doc)
    ]
    assert clauses == []


def entries_without_text(doc: str) -> list[str]:
    """Entries of the parameter and attribute lists of a docstring that have a name and a type alone."""
    bare = []
    for section in re.findall(
        r"^(?:Parameters|Attributes)\n-+\n(.*?)(?=^\w[^\n]*\n---|\Z)", doc, re.MULTILINE | re.DOTALL
    ):
        lines = section.splitlines()
        for line, following in zip(lines, [*lines[1:], ""], strict=True):
            if line and not line.startswith(" ") and not following.startswith(" "):
                bare.append(line)
    return bare


@pytest.mark.parametrize("package", sorted({package_of(file) for file in files()}))
def test_parameters_say_more_than_their_type(package):
    bare = [
        f"{where}: {entry}"
        for file in files()
        if package_of(file) == package
        for where, node, doc in documented(file)
        if not getattr(node, "name", "").startswith("_")
        for entry in entries_without_text(doc)
    ]
    assert bare == []


def names_in(file: Path) -> Iterator[str]:
    """Names of the file, its classes, functions, parameters and annotated attributes."""
    yield file.stem
    for node in ast.walk(tree(file)):
        if isinstance(node, (*FUNCTIONS, ast.ClassDef)):
            yield node.name
        elif isinstance(node, ast.arg):
            yield node.arg
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            yield node.target.id


@pytest.mark.parametrize("package", sorted({package_of(file) for file in files()}))
def test_terms_given_up_are_gone(package):
    old = sorted(
        f"{file}: {name}"
        for file in files()
        if package_of(file) == package
        for name in set(names_in(file))
        if (package, name) not in ALLOWED
        and (
            name in GIVEN_UP_CLASSES
            or GIVEN_UP & set(re.findall(r"[a-z]+", re.sub(r"([A-Z])", r"_\1", name).lower()))
        )
    )
    assert old == []


def test_the_glossary_has_no_term_given_up():
    glossary = (ROOT / "docs" / "concepts" / "glossary.md").read_text(encoding="utf-8")
    terms = re.findall(r"^\*\*(.+?)\*\*", glossary, re.MULTILINE)
    assert len(terms) >= 25
    assert terms == sorted(terms, key=str.casefold)
    assert not GIVEN_UP & {term.casefold() for term in terms}
