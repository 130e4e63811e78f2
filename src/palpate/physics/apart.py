"""Bodies from files of other programs: read, meshed and solved in a child process, which they may crash or hang.

Netgen, the CAD kernel and sparse solvers are written in C++, and some surfaces end the process in which they run.
A shape says by `foreign` that it is of this kind. In a process that is such a child already, as in a sweep, the work
is done at once.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import Any, TypeVar

from palpate.errors import SolverError
from palpate.processes import CASE_LIMIT, is_supervised
from palpate.supervised import ChildEnded, run_in_child

__all__ = ["MESH_LIMIT", "is_foreign", "mesh_apart", "read_apart", "solve_apart"]

MESH_LIMIT = 600.0
"""Time in s after which a file that is still being read or meshed is given up."""

Result = TypeVar("Result")


def is_foreign(geometry: Any) -> bool:
    """Tell whether work on this geometry should go to a child process."""
    return bool(getattr(geometry, "foreign", False)) and not is_supervised()


def mesh_apart(function: Callable[..., Any], *arguments: Any, doing: str) -> Any:
    """Return the `netgen.meshing.Mesh` that a function makes in a child process, as `read_apart` does."""
    # the round trip is also made where the mesh is made here: a curved one differs by it in its last bits
    return pickle.loads(read_apart(_pickled, function, arguments, doing=doing))


def _pickled(function: Callable[..., Any], arguments: tuple[Any, ...]) -> bytes:
    return pickle.dumps(function(*arguments))


def read_apart(function: Callable[..., Result], *arguments: Any, doing: str) -> Result:
    """Return what a function at the top of a module makes of a foreign file, in a child process.

    `doing` is the work in words, "meshing the solid of body.stl", for the `SolverError` that is raised if the work ends
    its process or takes longer than `MESH_LIMIT`.
    """
    try:
        return run_in_child(function, *arguments, limit=MESH_LIMIT)
    except ChildEnded as error:
        raise SolverError(
            f"A child process ended while {doing}: {error.reason}.",
            why="Damaged files, surfaces that touch or cut themselves, and details far below the elements can do that.",
            fix="Repair the surface and unite touching bodies in the program that made the file, or change `element`.",
        ) from error


def solve_apart(problem: Any, x: Any, options: dict[str, Any]) -> Any:
    """Return the solution of a problem of a foreign body, found in a child process.

    A solver that ends its process, or takes longer than a case of a sweep may by default, is a `SolverError`.
    """
    try:
        return run_in_child(_solve, problem, x, options, limit=CASE_LIMIT)
    except ChildEnded as error:
        raise SolverError(
            f"A child process ended while solving: {error.reason}.",
            why=error.details.partition("\n")[0],
            fix="Use larger elements if memory was short, or look at the mesh: problem.mesh.quality.",
        ) from error


def _solve(problem: Any, x: Any, options: dict[str, Any]) -> Any:
    return problem.open().solve(x, **options)
