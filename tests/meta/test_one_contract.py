"""Whatever takes what was learnt asks what it has, and never of which class a part is."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from sources import files, package_of, tree

from palpate.dataset import Dataset
from palpate.network import Network
from palpate.network.kinds import registered_kinds
from palpate.surrogates import AxisPlaces, Baseline, Field, LearntQuantities, MeshPlaces, Surrogate
from palpate.surrogates.memories import Memory

BASES = (Field, Baseline, Memory)
KINDS = {kind.__name__ for base in BASES for kind in (base, *registered_kinds(base).values())}
PARTS = KINDS | {kind.__name__ for kind in (AxisPlaces, Dataset, LearntQuantities, MeshPlaces)}
WHOLE = PARTS | {kind.__name__ for kind in (Network, Surrogate)} | {"AnswerNetwork"}
FORBIDDEN = {"export": WHOLE, "viewer": WHOLE} | dict.fromkeys(
    ("adapters", "cli", "improvement", "runtime", "study", "validation"), PARTS
)


def classes_asked_for(module: ast.Module) -> Iterator[str]:
    """Names in the second argument of `isinstance`, and of the types that a function is dispatched by."""
    for node in ast.walk(module):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "isinstance":
            yield from (part.id for part in ast.walk(node.args[1]) if isinstance(part, ast.Name))
        if isinstance(node, ast.MatchClass) and isinstance(node.cls, ast.Name):
            yield node.cls.id
        if isinstance(node, ast.Attribute) and node.attr == "singledispatch":
            yield "singledispatch"


@pytest.mark.parametrize("package", sorted(FORBIDDEN))
def test_no_part_is_asked_for_its_class(package):
    wrong = FORBIDDEN[package] | {"singledispatch"}
    asked = {
        f"{file}: {name}"
        for file in files()
        if package_of(file) == package
        for name in classes_asked_for(tree(file))
        if name in wrong
    }
    assert asked == set(), "ask what it has: can_be_touched, surface_fields, line, modal_fields, is_history"


def test_the_kinds_stand_in_the_registries():
    assert {"FieldSurrogate", "ModalField", "NodeField", "PadBaseline", "ContactBaseline"} <= KINDS


def test_a_test_for_a_class_is_noticed():
    module = ast.parse(
        "if isinstance(x, int | NodeField):\n    pass\nmatch x:\n    case Dataset():\n        pass"
    )
    assert {"NodeField", "Dataset"} <= set(classes_asked_for(module))


def test_one_place_makes_a_surrogate_of_a_network():
    """A network alone is a surrogate with quantities from there on."""
    asking = {
        file
        for file in files()
        if package_of(file) == "surrogates" and "Network" in classes_asked_for(tree(file))
    }
    assert asking == {Path("surrogates/surrogate.py")}
