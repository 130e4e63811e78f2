"""The registry of kinds: which dataclasses may stand in a file where a base class is declared, by name.

A process that was started by another one is told the modules that have registered kinds there, and imports them only
where a file needs them.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping
from dataclasses import is_dataclass

from palpate.errors import UsageError

__all__ = [
    "UnknownKindError",
    "import_next",
    "import_when_needed",
    "outside_modules",
    "register_kind",
    "registered_kinds",
    "registrations",
    "same_class",
]

_kinds: dict[type, dict[str, type]] = {}
_not_imported: list[str] = []


class UnknownKindError(ValueError):
    """A file holds a kind that no module has registered."""

    fix = (
        "Import the module that registers it first. For the real-time process the class stands in a module of its own: "
        "it can't import the script that is run."
    )


def register_kind(base: type, kind: type, name: str | None = None) -> None:
    """Let fields declared as `base` hold a `kind`, stored under a name.

    Parameters
    ----------
    base : type
        The base class or protocol that fields are annotated with.
    kind : type
        A dataclass of its own fields.
    name : str, optional
        What files call it; by default its class attribute ``name``.

    Raises
    ------
    UsageError
        If it is no dataclass, has no name, or another one has the name.
    """
    name = getattr(kind, "name", None) if name is None else name
    if not (is_dataclass(kind) and isinstance(name, str)):
        raise UsageError(
            f"{kind.__name__} can't stand for {base.__name__} in files.",
            why="A file stores it field by field, under its name.",
            fix="Make it a frozen dataclass with a class attribute `name`.",
        )
    names = _kinds.setdefault(base, {})
    if not same_class(names.get(name, kind), kind):
        raise UsageError(
            f"There is already a {base.__name__} called {name!r}, {names[name].__qualname__}.",
            fix="Give the new one another name: files tell them apart by it.",
        )
    names[name] = kind


def registered_kinds(base: type) -> Mapping[str, type]:
    """Return the dataclasses, by name, that may stand where a field is declared as `base`."""
    return dict(_kinds.get(base, {}))


def outside_modules() -> tuple[str, ...]:
    """Return the modules outside palpate, by name, whose classes are registered; a script itself is none."""
    names = dict.fromkeys(kind.__module__ for kinds in _kinds.values() for kind in kinds.values())
    return tuple(name for name in names if name.partition(".")[0] not in {"palpate", "__main__"})


def import_when_needed(modules: Iterable[str]) -> None:
    """Let files of kinds that this process does not know import these modules, one after the other.

    They are, for example, the `outside_modules` of the process that started this one.
    """
    _not_imported.extend(modules)


def import_next() -> bool:
    """Import the next of these modules; False where none is left."""
    if not _not_imported:
        return False
    importlib.import_module(_not_imported.pop(0))
    return True


def registrations() -> int:
    """Return how many kinds are registered."""
    return sum(map(len, _kinds.values()))


def same_class(one: type, other: type) -> bool:
    """Return whether two classes are one by name: a module may have been imported anew."""
    return (one.__module__, one.__qualname__) == (other.__module__, other.__qualname__)
