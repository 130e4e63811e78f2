"""A learnt body as a program of arrays, for libraries that differentiate and compile such programs.

The formulas are those of the ONNX export; here their operators are carried out by the library that the arrays are of,
one after the other, and only those that the wanted output needs. So whatever the library can do with its own operators
it can do with a touch: gradients of any order, batches, compilation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.export.onnx_body import add_body, add_torque
from palpate.export.onnx_graph import Graph, Node
from palpate.surrogates import Surrogate

__all__ = ["ArrayProgram", "Operators", "program_of"]

# one library's operators, by their ONNX names: (arrays, attributes) -> array
Operators = Mapping[str, Callable[[Sequence[Any], Mapping[str, Any]], Any]]


@dataclass(frozen=True)
class ArrayProgram:
    """One output of a body: the operators that it needs, in order, and their constants."""

    nodes: tuple[Node, ...]
    constants: Mapping[str, np.ndarray]
    output: str
    inputs: int  # columns of x

    def run(self, x: Any, constants: Mapping[str, Any], operators: Operators) -> Any:
        """Return the output (N, …) at inputs x (N, n), by a library's operators and its own constants.

        A value is dropped after the last operator that takes it.
        """
        values: dict[str, Any] = {"x": x}
        for node, done in zip(self.nodes, self._last_uses(), strict=True):
            operands = [values[k] if k in values else constants[k] for k in node.operands]
            values[node.result] = operators[node.kind](operands, node.attributes)
            for key in done:
                values.pop(key, None)
        return values[self.output]

    def _last_uses(self) -> list[list[str]]:
        """Return for each operator the values that no later one takes."""
        later, uses = {self.output}, []
        for node in reversed(self.nodes):
            uses.append([k for k in node.operands if k not in later])
            later.update(node.operands)
        return uses[::-1]


def program_of(body: Surrogate, dtype: type[np.floating]) -> dict[str, ArrayProgram]:
    """Return the programs of a body's outputs, by name: see `palpate.export.onnx_body.BODY_OUTPUTS`.

    A body that remembers how it was touched, or whose baseline has no such form, is refused.
    """
    if body.memory is not None:
        raise UsageError(
            f"The memory {body.memory.name!r} is no function of a place.",
            why="A batch of places has no history.",
            fix="Take the body without: body.with_memory(None).",
        )
    graph = Graph(dtype)
    add_body(graph, body.hand_energy, apart=True)
    add_torque(graph, body)
    names = [node.result for node in graph.nodes if node.kind == "Identity"]
    return {name: _part_for(graph, name, len(body.inputs)) for name in names}


def _part_for(graph: Graph, output: str, inputs: int) -> ArrayProgram:
    """Return the part of a graph that an output needs."""
    wanted, nodes = {output}, []
    for node in reversed(graph.nodes):
        if node.result in wanted:
            nodes.append(node)
            wanted.update(node.operands)
    constants = {name: values for name, values in graph.constants.items() if name in wanted}
    return ArrayProgram(tuple(nodes[::-1]), constants, output, inputs)
