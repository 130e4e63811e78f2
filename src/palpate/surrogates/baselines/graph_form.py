"""A baseline as a graph of array operations over many rows: the form in which it goes out to ONNX.

Below, N is the number of rows, a scalar is (N, 1), a vector (N, 3), a matrix (N, 3, 3). A `Value` is a result in the
graph, with the operators of an array; the `Graph` gives what arrays have no operator for (see
`palpate.export.onnx_graph`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    from palpate.surrogates.surface import TouchedSurface

__all__ = ["BaselineForm", "Distance", "Graph", "Touch", "Value", "outer"]

Graph: TypeAlias = Any
Value: TypeAlias = Any
# places (N, 3) → distance (N, 1), its gradient (N, 3) and its Hessian (N, 3, 3)
Distance: TypeAlias = Callable[[Value], tuple[Value, Value, Value]]


@dataclass(frozen=True)
class BaselineForm:
    """A baseline at a place: its energy with derivatives, and the signed root."""

    energy: Value  # U₀ (N, 1)
    gradient: Value  # ∇U₀ (N, 3)
    hessian: Value  # ∇²U₀ (N, 3, 3)
    root: Value  # signed root of 2 U₀ (N, 1)
    by: Value  # its slope (N, 3)


@dataclass(frozen=True)
class Touch:
    """A probe at a surface: its depth, and how far that is beyond training."""

    distance: Distance  # to the surface, of any places
    distance_to: Callable[[TouchedSurface], Distance]  # to another surface
    depth: Value  # s (N, 1)
    contact: Value  # bool (N, 1)
    normal: Value  # ∇d (N, 3)
    bend: Value  # ∇²d (N, 3, 3)
    excess: Value  # s − σ(s)
    slope: Value  # σ'
    curvature: Value  # σ''


def outer(a: Value, b: Value) -> Value:
    """Return a bᵀ (N, m, m) of vectors (N, m)."""
    return a.spread(2) * b.spread(1)
