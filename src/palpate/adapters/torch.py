"""A learnt body as functions of torch tensors, which torch differentiates by itself.

    touch = TorchBody("kidney.palpate")
    U = touch.energy(x)                     # (N,) J, of inputs (N, n); U.sum().backward() gives −F
    F = touch.force(x)                      # (N, 3) N

The numbers are those of palpate's own kernels to rounding, for any number of rows on any device of torch. In double
precision on the processor the kernels themselves answer energy, force and stiffness, each one's slope being the next.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from palpate.adapters.array_program import Operators, program_of
from palpate.adapters.extra import import_extra
from palpate.adapters.torch_kernels import SLOPES, kernel_function
from palpate.errors import UsageError
from palpate.surrogates import Surrogate

__all__ = ["TorchBody"]

_TOGETHER = 2048  # rows whose numbers stay in a core's cache


class TorchBody:
    """Energy, force, stiffness and trust of a learnt body, as functions of torch tensors.

    Parameters
    ----------
    body : Surrogate or path
        The learnt body, or its file.
    dtype : torch.dtype, optional
        Precision of the numbers: ``torch.float64`` by default, or ``torch.float32``.

    Raises
    ------
    UsageError
        If torch is not installed, the precision is another one, or the body remembers or has no such form.
    """

    def __init__(self, body: Surrogate | str | os.PathLike[str], dtype: Any = None) -> None:
        self._torch = torch = import_extra("torch", "torch")
        self.body = body if isinstance(body, Surrogate) else Surrogate.load(body)
        self.dtype = torch.float64 if dtype is None else dtype
        kinds: dict[Any, type[np.floating]] = {torch.float64: np.float64, torch.float32: np.float32}
        if self.dtype not in kinds:
            raise UsageError(
                f"A learnt body has no numbers of {dtype}.", fix="Take torch.float64 or torch.float32."
            )
        self._programs = program_of(self.body, kinds[self.dtype])
        self._operators = _operators(torch, self.dtype)
        self._constants: dict[Any, dict[str, Mapping[str, Any]]] = {}
        self._kernels = kernel_function(torch, self.body, self._run_program)

    def energy(self, x: Any) -> Any:
        """Return U (N,), J, at inputs x (N, n): the felt coordinates in m first."""
        return self._run("energy", x)

    def force(self, x: Any) -> Any:
        """Return F = −∂U/∂x (N, 3), N, on the hand."""
        return self._run("force", x)

    def stiffness(self, x: Any) -> Any:
        """Return ∂F/∂x (N, 3, 3), N/m."""
        return self._run("stiffness", x)

    def torque(self, x: Any) -> Any:
        """Return the torque on the tool about its place, N m, of the shape of `force`.

        Raises
        ------
        UsageError
            If the body was learnt without one, as under a ball.
        """
        return self._run("torque", x)

    def depth(self, x: Any) -> Any:
        """Return the baseline's own coordinate s (N,), m: a probe's depth, negative without contact."""
        return self._run("depth", x)[:, 0]

    def inside(self, x: Any) -> Any:
        """Return whether the answers (N,) are of the trained region."""
        return self._run("inside", x)[:, 0]

    def deviation(self, x: Any) -> Any:
        """Return the standard deviation (N,) of the force relative to its size.

        Raises
        ------
        UsageError
            If the body has no posterior.
        """
        return self._run("deviation", x)[:, 0]

    def _run(self, name: str, x: Any) -> Any:
        torch = self._torch
        if name not in self._programs:
            raise UsageError(
                f"The body {self.body.name!r} does not know its {name}.",
                fix="Learn it with a posterior."
                if name == "deviation"
                else "Learn it under a pp.SurfaceTool.",
            )
        program = self._programs[name]
        if not torch.is_tensor(x) or x.dtype != self.dtype or x.ndim != 2 or x.shape[1] != program.inputs:
            got = f"{tuple(x.shape)} of {x.dtype}" if torch.is_tensor(x) else type(x).__name__
            raise UsageError(
                f"The inputs must be a tensor (N, {program.inputs}) of {self.dtype}, and are {got}.",
                why=f"They are {', '.join(r.name for r in self.body.inputs)}.",
                fix="Convert them, or make the body with that dtype.",
            )
        if name in SLOPES and self.dtype == torch.float64 and x.device.type == "cpu":
            return self._kernels.apply(x, name)[0]
        return self._run_program(name, x)

    def _run_program(self, name: str, x: Any) -> Any:
        """Return an output at checked rows by torch's own operators; the energy is (N,)."""
        torch, program = self._torch, self._programs[name]
        there = self._constants.setdefault(x.device, {})
        if name not in there:
            there[name] = {k: torch.tensor(v, device=x.device) for k, v in program.constants.items()}
        parts = [program.run(some, there[name], self._operators) for some in x.split(_TOGETHER)]
        whole = parts[0] if len(parts) == 1 else torch.cat(parts)
        return whole[:, 0] if name == "energy" else whole


def _numbers(value: Any) -> list[int]:
    return [int(v) for v in value.tolist()]


def _operators(torch: Any, dtype: Any) -> Operators:
    """Return the operators of torch by their ONNX names."""
    two: dict[str, Callable[..., Any]] = {
        "Add": torch.add, "Sub": torch.sub, "Mul": torch.mul, "MatMul": torch.matmul,
        "Greater": torch.gt, "Less": torch.lt, "LessOrEqual": torch.le, "Equal": torch.eq,
        "And": torch.logical_and, "Or": torch.logical_or, "Max": torch.maximum, "Min": torch.minimum,
    }  # fmt: skip
    one: dict[str, Callable[..., Any]] = {
        "Neg": torch.neg, "Not": torch.logical_not, "Exp": torch.exp, "Sqrt": torch.sqrt, "Tanh": torch.tanh,
        "Floor": torch.floor, "Identity": torch.clone,
    }  # fmt: skip

    def divide(operands: Sequence[Any], _: Mapping[str, Any]) -> Any:
        a, b = operands
        whole = not (a.is_floating_point() or b.is_floating_point())
        return torch.div(a, b, rounding_mode="trunc" if whole else None)

    def reshape(operands: Sequence[Any], _: Mapping[str, Any]) -> Any:
        value, shape = operands
        return value.reshape(value.shape[0], *_numbers(shape)[1:])

    def unsqueeze(operands: Sequence[Any], _: Mapping[str, Any]) -> Any:
        value = operands[0]
        for axis in sorted(_numbers(operands[1])):
            value = value.unsqueeze(axis)
        return value

    def cut(operands: Sequence[Any], _: Mapping[str, Any]) -> Any:
        value, (start,), (stop,), (axis,) = operands[0], *(_numbers(v) for v in operands[1:])
        return value.narrow(axis, start, stop - start)

    def gather(operands: Sequence[Any], attributes: Mapping[str, Any]) -> Any:
        table, places = operands
        if attributes["axis"] == 0:
            return table[places.long()]
        return table.index_select(attributes["axis"], places)

    more = {
        "Div": divide, "Reshape": reshape, "Unsqueeze": unsqueeze, "Slice": cut, "Gather": gather,
        "Where": lambda v, _: torch.where(v[0], v[1], v[2]),
        "Concat": lambda v, a: torch.cat(list(v), dim=a["axis"]),
        "ReduceSum": lambda v, _: v[0].sum(dim=_numbers(v[1]), keepdim=True),
        "ReduceMin": lambda v, a: v[0].amin(dim=a["axes"], keepdim=True),
        "Transpose": lambda v, a: v[0].permute(a["perm"]),
        "Cast": lambda v, a: v[0].to(torch.int64 if a["to"] is np.int64 else dtype),
    }  # fmt: skip

    def plain(function: Callable[..., Any]) -> Callable[..., Any]:
        return lambda operands, _: function(*operands)

    return {k: plain(f) for k, f in (one | two).items()} | more
