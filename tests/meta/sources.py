"""The package's own source files, as text and as syntax trees."""

from __future__ import annotations

import ast
import functools
from pathlib import Path

import palpate

ROOT = Path(__file__).parents[2]
PACKAGE = Path(palpate.__file__).parent


@functools.cache
def files() -> tuple[Path, ...]:
    """Every Python file of the package, relative to it, without the benchmark that a wheel carries beside them."""
    others = {"client", "soft_touch"}
    return tuple(
        sorted(p for f in PACKAGE.rglob("*.py") if others.isdisjoint((p := f.relative_to(PACKAGE)).parts))
    )


@functools.cache
def text(file: Path) -> str:
    return (PACKAGE / file).read_text(encoding="utf-8")


@functools.cache
def tree(file: Path) -> ast.Module:
    return ast.parse(text(file))


def package_of(file: Path) -> str:
    """Name of the package in which a file is, ``"root"`` for the modules beside the packages."""
    return file.parts[0] if len(file.parts) > 1 else "root"


def body_without_docstring(node: ast.FunctionDef | ast.AsyncFunctionDef) -> list[ast.stmt]:
    return node.body[1:] if ast.get_docstring(node, clean=False) is not None else node.body


FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
