"""A graph of ONNX operators, written as one writes arrays: sums, products and functions of values of a graph.

Opset 13 with IR 8 is all that is used, so that runtimes of several years take it. Each scalar is a column (N, 1), N
being the free number of rows; nothing else of a shape is known here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from palpate.errors import UsageError

__all__ = ["OPSET", "Graph", "Node", "Value", "require_onnx"]

OPSET, IR = 13, 8  # versions of the operators and of the format of ONNX


def require_onnx() -> Any:
    """Return the package onnx."""
    try:
        import onnx
    except ImportError:
        raise UsageError(
            "The package onnx is not installed.",
            why="Only exports to ONNX need it, so it does not come with palpate.",
            fix="Run: pip install 'palpate[onnx]'",
        ) from None
    return onnx


class Node(NamedTuple):
    """One operator of a graph: its kind, the names of what it takes and makes, its attributes, and its own name."""

    kind: str
    operands: tuple[str, ...]
    result: str
    attributes: Mapping[str, Any]
    name: str


def _operator(name: str, *, turned: bool = False) -> Callable[[Value, Any], Value]:
    """Return the method that adds an operator to the graph; `turned` where the value is the right operand."""

    def apply(self: Value, other: Any) -> Value:
        return self.graph.op(name, other, self) if turned else self.graph.op(name, self, other)

    return apply


class Value:
    """A tensor that a graph computes; arithmetic with it adds operators to its graph."""

    __slots__ = ("graph", "name")
    __array_priority__ = 100  # arrays on the left leave the arithmetic to this class

    def __init__(self, graph: Graph, name: str) -> None:
        self.graph, self.name = graph, name

    __add__, __radd__ = _operator("Add"), _operator("Add", turned=True)
    __sub__, __rsub__ = _operator("Sub"), _operator("Sub", turned=True)
    __mul__, __rmul__ = _operator("Mul"), _operator("Mul", turned=True)
    __truediv__, __rtruediv__ = _operator("Div"), _operator("Div", turned=True)
    __matmul__, __rmatmul__ = _operator("MatMul"), _operator("MatMul", turned=True)
    __gt__, __lt__, __le__ = _operator("Greater"), _operator("Less"), _operator("LessOrEqual")
    __and__, __or__ = _operator("And"), _operator("Or")

    def __neg__(self) -> Value:
        return self.graph.op("Neg", self)

    def __invert__(self) -> Value:
        return self.graph.op("Not", self)

    def columns(self, start: int, stop: int) -> Value:
        """Return columns start … stop − 1 of a table (N, n)."""
        numbers = [self.graph.integers([value]) for value in (start, stop, 1)]
        return self.graph.op("Slice", self, numbers[0], numbers[1], numbers[2])

    def rows_as(self, *shape: int) -> Value:
        """Return the tensor (N, …) with another shape of its rows, (N, *shape); N may be 0."""
        return self.graph.op("Reshape", self, self.graph.integers([0, *shape]))

    def spread(self, *axes: int) -> Value:
        """Return the tensor with further axes of length 1 at these places."""
        return self.graph.op("Unsqueeze", self, self.graph.integers(axes))

    def sum(self, *axes: int) -> Value:
        """Return the sum over axes, which stay with length 1."""
        return self.graph.op("ReduceSum", self, self.graph.integers(axes), keepdims=1)

    def least(self, axis: int) -> Value:
        """Return the least along an axis, which stays with length 1."""
        return self.graph.op("ReduceMin", self, axes=[axis], keepdims=1)

    def swap(self) -> Value:
        """Return matrices (N, a, b) turned over, (N, b, a)."""
        return self.graph.op("Transpose", self, perm=[0, 2, 1])


class Graph:
    """Operators and constants of one graph whose numbers are all float64, or all float32.

    Nodes bear the name of the `stage` that is being worked out, so that a runtime's error says where.
    """

    def __init__(self, dtype: type[np.floating]) -> None:
        self.dtype = dtype
        self.stage = "inputs"
        self.nodes: list[Node] = []
        self.constants: dict[str, np.ndarray] = {}
        self._names: dict[tuple[Any, ...], str] = {}
        self._inputs: list[tuple[str, Any, Sequence[int | None]]] = []
        self._outputs: list[tuple[str, Any, Sequence[int | None]]] = []

    def input(self, name: str, columns: int) -> Value:
        """Return an input (N, columns) of the graph."""
        self._inputs.append((name, self.dtype, [None, columns]))
        return Value(self, name)

    def output(self, name: str, value: Value, shape: Sequence[int], kind: Any = None) -> None:
        """Name a value as an output (N, *shape) of the graph."""
        self.nodes.append(Node("Identity", (value.name,), name, {}, f"outputs/{name}"))
        self._outputs.append((name, kind or self.dtype, [None, *shape]))

    def integers(self, values: Sequence[int]) -> Value:
        """Return a constant of whole numbers (n,)."""
        return self._constant(np.asarray(values, dtype=np.int64))

    def constant(self, values: Any) -> Value:
        """Return a constant in the graph's precision."""
        return self._constant(np.asarray(values, dtype=self.dtype))

    def table(self, values: np.ndarray) -> Value:
        """Return a constant of the numbers' own kind: int32 or int64."""
        return self._constant(values)

    def _constant(self, values: np.ndarray) -> Value:
        key = (values.dtype.str, values.shape, values.tobytes())
        if key not in self._names:
            self._names[key] = f"c{len(self._names)}"
            self.constants[self._names[key]] = np.ascontiguousarray(values)
        return Value(self, self._names[key])

    def op(self, kind: str, *operands: Any, **attributes: Any) -> Value:
        """Return what an operator makes of values, numbers and arrays."""
        names = tuple((v if isinstance(v, Value) else self.constant(v)).name for v in operands)
        name, own = f"v{len(self.nodes)}", f"{self.stage}/{kind}_{len(self.nodes)}"
        self.nodes.append(Node(kind, names, name, attributes, own))
        return Value(self, name)

    def exp(self, value: Value) -> Value:
        """Return e to the power of a value."""
        return self.op("Exp", value)

    def sqrt(self, value: Value) -> Value:
        """Return the square root of a value."""
        return self.op("Sqrt", value)

    def tanh(self, value: Value) -> Value:
        """Return the hyperbolic tangent of a value."""
        return self.op("Tanh", value)

    def maximum(self, a: Any, b: Any) -> Value:
        """Return the larger of two values."""
        return self.op("Max", a, b)

    def minimum(self, a: Any, b: Any) -> Value:
        """Return the smaller of two values."""
        return self.op("Min", a, b)

    def where(self, condition: Value, a: Any, b: Any) -> Value:
        """Return a where a condition holds, else b."""
        return self.op("Where", condition, a, b)

    def join(self, *values: Any, axis: int = 1) -> Value:
        """Return values one after the other along an axis."""
        return self.op("Concat", *values, axis=axis)

    def whole(self, value: Value) -> Value:
        """Return a value cut to a whole number of int64."""
        return self.op("Cast", value, to=np.int64)

    def real(self, value: Value) -> Value:
        """Return whole numbers or truth values as numbers of the graph's precision."""
        return self.op("Cast", value, to=self.dtype)

    def model(self, name: str, metadata: Mapping[str, str]) -> Any:
        """Return the model (a `ModelProto`), checked with its shapes."""
        onnx = require_onnx()
        helper = onnx.helper

        def code(dtype: Any) -> int:
            return int(helper.np_dtype_to_tensor_dtype(np.dtype(dtype)))

        nodes = [
            helper.make_node(
                n.kind,
                list(n.operands),
                [n.result],
                name=n.name,
                **{k: code(v) if k == "to" else v for k, v in n.attributes.items()},
            )
            for n in self.nodes
        ]
        ends = [
            [
                helper.make_tensor_value_info(key, code(dtype), ["N", *shape[1:]])
                for key, dtype, shape in group
            ]
            for group in (self._inputs, self._outputs)
        ]
        tensors = [onnx.numpy_helper.from_array(values, key) for key, values in self.constants.items()]
        model = helper.make_model(
            helper.make_graph(nodes, name, *ends, tensors),
            opset_imports=[helper.make_opsetid("", OPSET)],
            ir_version=IR,
            producer_name="palpate",
        )
        helper.set_model_props(model, dict(metadata))
        onnx.checker.check_model(model, full_check=True)
        return model
