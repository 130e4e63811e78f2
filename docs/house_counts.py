"""Renews the counts of lines on the architecture page from the sources: python docs/house_counts.py."""

from __future__ import annotations

import ast
import functools
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "concepts" / "architecture.md"
PACKAGE = ROOT / "src" / "palpate"
TOP = "files at the top"
SENTENCE = (
    r"([\d,]+) lines of Python in (\d+) files, ([\d,]+) of them docstrings;\s"
    r"([\d,]+) lines of C and ([\d,]+) lines of TypeScript"
)
BEGIN, END = "<!-- counted: begin -->", "<!-- counted: end -->"


@functools.cache
def lines_of(file: Path) -> int:
    """Number of lines of a source file that are not blank."""
    return sum(1 for line in file.read_text(encoding="utf-8").splitlines() if line.strip())


@functools.cache
def docstring_lines(file: Path) -> int:
    """Number of these lines that are docstrings."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    owners = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    texts = (ast.get_docstring(node, clean=False) for node in ast.walk(tree) if isinstance(node, owners))
    return sum(1 for text in texts if text for line in text.splitlines() if line.strip())


def sources() -> list[Path]:
    """Return every Python file of the package."""
    return [file for file in PACKAGE.rglob("*.py") if "client" not in file.parts]


def package_lines() -> Counter[str]:
    """Return the lines of each package, and of the files beside them."""
    counts: Counter[str] = Counter()
    for file in sources():
        parts = file.relative_to(PACKAGE).parts
        counts[parts[0] if len(parts) > 1 else TOP] += lines_of(file)
    return counts


def house() -> dict[str, int]:
    """Return the whole: lines of Python, files, docstrings, lines of C, lines of TypeScript."""
    files, client = sources(), PACKAGE / "viewer" / "client" / "src"
    return {
        "Python": package_lines().total(),
        "files": len(files),
        "docstrings": sum(map(docstring_lines, files)),
        "C": sum(map(lines_of, PACKAGE.rglob("*.c"))),
        "TypeScript": sum(map(lines_of, client.rglob("*.ts"))),
    }


def counted(text: str) -> Iterator[tuple[str, int, int]]:
    """Yield name, number on the page and number in the sources of all that the page counts."""
    totals, truth = package_lines(), house()
    stated = re.search(SENTENCE, text)
    if stated is not None:
        yield from zip(truth, (_number(group) for group in stated.groups()), truth.values(), strict=True)
    for name, stated in re.findall(r"^\| `?([\w ]+?)`? \| ([\d,]+) \|", _table(text), re.MULTILINE):
        yield name, _number(stated), totals.pop(name, 0)
    for name, lines in totals.items():  # a package that the page does not have
        yield name, 0, lines
    for name, stated in re.findall(r"`([\w/.-]+)` \((\d+) lines\)", text):
        yield name, int(stated), lines_of(ROOT / "src" / "palpate" / name)


def renewed(text: str) -> str:
    """The page's text with its counts renewed: packages in hundreds, files as they are."""
    totals, truth = package_lines(), house()
    text = re.sub(
        SENTENCE,
        f"{_hundreds(truth['Python'])} lines of Python in {truth['files']} files, "
        f"{_hundreds(truth['docstrings'])} of them docstrings;\n"
        f"{_hundreds(truth['C'])} lines of C and {_hundreds(truth['TypeScript'])} lines of TypeScript",
        text,
    )
    before = _table(text)
    after = re.sub(
        r"^(\| `?([\w ]+?)`? \| )[\d,]+( \|)",
        lambda row: row[1] + _hundreds(totals.get(row[2], 0)) + row[3],
        before,
        flags=re.MULTILINE,
    )
    return re.sub(
        r"`([\w/.-]+)` \(\d+ lines\)",
        lambda file: f"`{file[1]}` ({lines_of(PACKAGE / file[1])} lines)",
        text.replace(before, after),
    )


def _table(text: str) -> str:
    return text.split(BEGIN)[1].split(END, maxsplit=1)[0]


def _number(text: str) -> int:
    return int(text.replace(",", ""))


def _hundreds(count: int) -> str:
    return f"{round(count, -2):,}"


if __name__ == "__main__":
    PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
