"""Exported names have full NumPy docstrings; an internal name has a sentence or two, and no tables.

Ruff's rules D1 ask for the docstrings themselves, and `test_language` for their first words.
"""

from __future__ import annotations

import ast
import functools
import importlib
import inspect
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from sources import FUNCTIONS, files, package_of, tree

from palpate import errors

pytestmark = pytest.mark.full  # the house's own rules, not what palpate does

TABLES = re.compile(r"^(Parameters|Other Parameters|Attributes|Returns|Yields|Raises)\n-{3,}$", re.MULTILINE)
CARRIED_BY_PROSE = 3  # arguments of an exported function that a sentence can name; more need the table
# Exported methods hand their options on to these and refer to them.
REFERRED_TO = {("palpate.physics.renderer", "plot_solution")}
# Exported records whose fields have their text and unit where they are declared.
DECLARED = {
    "State": "each field's unit stands beside it, where the shared memory's layout is declared",
    "Study": "each record's fields have them, and the study file's reference is made from these",
}
PACKAGES = sorted({package_of(file) for file in files()})


def module_of(file: Path) -> str:
    return ".".join(("palpate", *file.with_suffix("").parts)).removesuffix(".__init__")


@functools.cache
def exported() -> tuple[frozenset[tuple[str, str]], frozenset[tuple[str, str]]]:
    """Module and name of what packages export with its public methods, and of the classes that it is based on."""
    names, bases = set(), set()
    for file in files():
        if file.name != "__init__.py":
            continue
        package = importlib.import_module(module_of(file))
        for name in getattr(package, "__all__", ()):
            value = getattr(package, name)
            value = getattr(value, "py_func", value)  # a compiled kernel
            if inspect.isclass(value):
                for owner in value.__mro__:
                    members = [m for m in vars(owner) if not m.startswith("_") or m == "__call__"]
                    names |= {(owner.__module__, f"{owner.__qualname__}.{m}") for m in members}
                    bases.add((owner.__module__, owner.__qualname__))
            if hasattr(value, "__qualname__"):
                names.add((value.__module__, value.__qualname__))
    return frozenset(names), frozenset(bases - names)


Definition = ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


def definitions(node: ast.AST, prefix: str = "") -> Iterator[tuple[str, Definition]]:
    """Qualified name and node of each class and function, those inside others too."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, (*FUNCTIONS, ast.ClassDef)):
            name = prefix + child.name
            yield name, child
            yield from definitions(child, f"{name}.")
        else:
            yield from definitions(child, prefix)


def heads(doc: str, *sections: str) -> list[str]:
    """Lines with names and type of the entries of these sections of a docstring."""
    texts = [
        text
        for section in sections
        for text in re.findall(rf"^{section}\n-+\n(.*?)(?=^\w[^\n]*\n---|\Z)", doc, re.MULTILINE | re.DOTALL)
    ]
    return [line for text in texts for line in text.splitlines() if line and not line.startswith(" ")]


def entries(doc: str, *sections: str) -> list[str]:
    """Names of the entries of these sections of a docstring."""
    names = [name for head in heads(doc, *sections) for name in head.split(" : ")[0].split(",")]
    return [name.strip().lstrip("*") for name in names]


def fields(node: ast.ClassDef) -> list[str]:
    """Public fields that a record declares without their text: an `option` has it beside its default."""
    return [
        statement.target.id
        for statement in node.body
        if isinstance(statement, ast.AnnAssign)
        and isinstance(statement.target, ast.Name)
        and not statement.target.id.startswith("_")
        and "ClassVar" not in ast.unparse(statement.annotation)
        and "init=False" not in ast.unparse(statement)
        and not (isinstance(statement.value, ast.Call) and ast.unparse(statement.value.func) == "option")
    ]


def arguments(node: ast.FunctionDef | ast.AsyncFunctionDef, *, method: bool) -> list[str]:
    """Names of a function's public arguments, without the object or class that a method belongs to."""
    a = node.args
    own = [*a.posonlyargs, *a.args]
    if method and not any("staticmethod" in ast.unparse(d) for d in node.decorator_list):
        own = own[1:]
    rest = [extra for extra in (a.vararg, a.kwarg) if extra]
    return [each.arg for each in (*own, *a.kwonlyargs, *rest) if not each.arg.startswith("_")]


def option_records(node: ast.FunctionDef | ast.AsyncFunctionDef) -> set[str]:
    """Arguments that are a record of options, which has a text for each of them."""
    each = [*node.args.args, *node.args.kwonlyargs]
    return {a.arg for a in each if a.annotation and ast.unparse(a.annotation).endswith("Options")}


def raises_on_purpose(node: ast.AST) -> bool:
    """Whether a function itself, not one inside it, raises one of palpate's errors."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, (*FUNCTIONS, ast.Lambda)):
            continue
        if isinstance(child, ast.Raise) and isinstance(child.exc, ast.Call):
            kind = getattr(errors, ast.unparse(child.exc.func).rpartition(".")[2], None)
            if inspect.isclass(kind) and issubclass(kind, errors.PalpateError):
                return True
        if raises_on_purpose(child):
            return True
    return False


def gaps(name: str, node: Definition) -> Iterator[str]:
    """What the docstring of an exported name lacks; a setter has that of its property."""
    if (doc := ast.get_docstring(node)) is None:
        return
    listings = "Attributes", "Parameters", "Other Parameters"
    if untyped := [head for head in heads(doc, *listings) if " : " not in head and not head.startswith("*")]:
        yield f"{untyped} have no type"
    if isinstance(node, ast.ClassDef):
        if name not in DECLARED and (missing := set(fields(node)) - set(entries(doc, *listings))):
            yield f"Attributes lacks {sorted(missing)}"
        return
    method = "." in name
    taken, listed = arguments(node, method=method), entries(doc, *listings[1:])
    borrowed = re.search(r"\bother parameters\b[^.]*\bare those of\s+`", doc)
    missing = set() if borrowed else set(taken) - set(listed) - option_records(node)
    if missing and (listed or (not method and len(taken) > CARRIED_BY_PROSE)):
        yield f"Parameters lacks {sorted(missing)}"
    if unknown := set(listed) - set(taken):
        yield f"Parameters has {sorted(unknown)}, which it does not take"
    if raises_on_purpose(node) and not re.search(r"^Raises\n---", doc, re.MULTILINE):
        yield "Raises is missing"


@pytest.mark.parametrize("package", PACKAGES)
def test_exported_names_have_full_sections(package):
    """A record lists its fields, a function of many arguments lists them, one that refuses says what it raises."""
    names, _ = exported()
    lacking = [
        f"{file}:{name}: {gap}"
        for file in files()
        if package_of(file) == package
        for name, node in definitions(tree(file))
        if (module_of(file), name) in names
        for gap in gaps(name, node)
    ]
    assert not lacking, "\n".join(["see CONTRIBUTING, Names and language", *lacking])


@pytest.mark.parametrize("package", PACKAGES)
def test_internal_names_have_sentences_without_tables(package):
    public = frozenset.union(*exported()) | REFERRED_TO
    tabled = [
        f"{file}:{name}: {', '.join(TABLES.findall(doc))}"
        for file in files()
        if package_of(file) == package
        for name, node in definitions(tree(file))
        if (module_of(file), name) not in public and (doc := ast.get_docstring(node)) and TABLES.search(doc)
    ]
    advice = "weave shapes and units into the prose, or put them beside the fields"
    assert not tabled, "\n".join([advice, *tabled])


def test_the_check_tells_exported_names_from_internal_ones():
    names, bases = exported()
    method, kernel = (
        ("network.network", "Network.predict"),
        ("surrogates.surface.distance_kernels", "distance_into"),
    )
    base = "estimators.radial_regressor", "RadialRegressor"
    inherited = base[0], "RadialRegressor.fit"
    for module, name in (method, kernel, inherited):
        assert (f"palpate.{module}", name) in names
    assert (f"palpate.{base[0]}", base[1]) in bases
    assert ("palpate.network.container", "Container") not in names | bases
    assert set(DECLARED) <= {name for _, name in names}
