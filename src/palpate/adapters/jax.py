"""A learnt body as functions of JAX arrays, which JAX differentiates, maps and compiles.

    touch = JaxBody("kidney.palpate")
    F = -jax.grad(touch.energy)(x)                       # of one row (n,), or of rows (N, n) for touch.force
    K = jax.jit(jax.vmap(jax.jacfwd(touch.force)))(X)

With JAX's 64-bit numbers, ``jax.config.update("jax_enable_x64", True)``, they are those of palpate's own kernels to
rounding; without, they have seven digits.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from palpate.adapters.array_program import Operators, program_of
from palpate.adapters.extra import import_extra
from palpate.errors import UsageError
from palpate.surrogates import Surrogate

__all__ = ["JaxBody"]

_TOGETHER = 1024  # rows whose numbers stay in a core's cache; more at once take three times as long


class JaxBody:
    """Energy, force, stiffness and trust of a learnt body, as functions of JAX arrays.

    Each takes one row of inputs (n,) or rows (N, n): the felt coordinates in m first.

    Parameters
    ----------
    body : Surrogate or path
        The learnt body, or its file.

    Raises
    ------
    UsageError
        If JAX is not installed, or the body remembers or has no such form.
    """

    def __init__(self, body: Surrogate | str | os.PathLike[str]) -> None:
        self._jax = jax = import_extra("jax", "jax")
        self.body = body if isinstance(body, Surrogate) else Surrogate.load(body)
        self.dtype = np.float64 if jax.config.jax_enable_x64 else np.float32
        self._programs = program_of(self.body, self.dtype)
        self._operators = _operators(import_extra("jax.numpy", "jax"), self.dtype)

    def energy(self, x: Any) -> Any:
        """Return U, J, of a row; (N,) of rows."""
        return self._run("energy", x)[..., 0]

    def force(self, x: Any) -> Any:
        """Return F = −∂U/∂x (3,), N, on the hand; (N, 3) of rows."""
        return self._run("force", x)

    def stiffness(self, x: Any) -> Any:
        """Return ∂F/∂x (3, 3), N/m; (N, 3, 3) of rows."""
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
        """Return the baseline's own coordinate s, m: a probe's depth, negative without contact; (N,) of rows."""
        return self._run("depth", x)[..., 0]

    def inside(self, x: Any) -> Any:
        """Return whether the answer is of the trained region; (N,) of rows."""
        return self._run("inside", x)[..., 0]

    def deviation(self, x: Any) -> Any:
        """Return the standard deviation of the force relative to its size; (N,) of rows.

        Raises
        ------
        UsageError
            If the body has no posterior.
        """
        return self._run("deviation", x)[..., 0]

    def _run(self, name: str, x: Any) -> Any:
        if name not in self._programs:
            raise UsageError(
                f"The body {self.body.name!r} does not know its {name}.",
                fix="Learn it with a posterior."
                if name == "deviation"
                else "Learn it under a pp.SurfaceTool.",
            )
        program = self._programs[name]
        rows = self._jax.numpy.asarray(x, dtype=self.dtype)
        if rows.ndim not in (1, 2) or rows.shape[-1] != program.inputs:
            raise UsageError(
                f"The inputs must have shape ({program.inputs},) or (N, {program.inputs}), not {rows.shape}.",
                why=f"They are {', '.join(r.name for r in self.body.inputs)}.",
                fix="Give one number for each, the felt coordinates in m first.",
            )

        def answer(some: Any) -> Any:
            return program.run(some, program.constants, self._operators)

        if rows.ndim == 1:
            return answer(rows[None])[0]
        if len(rows) < 2 * _TOGETHER:
            return answer(rows)
        return self._jax.lax.map(lambda row: answer(row[None])[0], rows, batch_size=_TOGETHER)


def _numbers(value: Any) -> list[int]:
    return [int(v) for v in np.asarray(value)]


def _operators(jnp: Any, dtype: Any) -> Operators:
    """Return the operators of JAX by their ONNX names."""
    two: dict[str, Callable[..., Any]] = {
        "Add": jnp.add, "Sub": jnp.subtract, "Mul": jnp.multiply, "MatMul": jnp.matmul,
        "Greater": jnp.greater, "Less": jnp.less, "LessOrEqual": jnp.less_equal, "Equal": jnp.equal,
        "And": jnp.logical_and, "Or": jnp.logical_or, "Max": jnp.maximum, "Min": jnp.minimum,
    }  # fmt: skip
    one: dict[str, Callable[..., Any]] = {
        "Neg": jnp.negative, "Not": jnp.logical_not, "Exp": jnp.exp, "Sqrt": jnp.sqrt, "Tanh": jnp.tanh,
        "Floor": jnp.floor, "Identity": jnp.asarray,
    }  # fmt: skip

    def divide(operands: Sequence[Any], _: Mapping[str, Any]) -> Any:
        a, b = operands
        whole = all(np.issubdtype(v.dtype, np.integer) for v in (a, b))
        return jnp.floor_divide(a, b) if whole else jnp.divide(a, b)  # whole numbers here are not negative

    def reshape(operands: Sequence[Any], _: Mapping[str, Any]) -> Any:
        value, shape = operands
        return value.reshape(value.shape[0], *_numbers(shape)[1:])

    def cut(operands: Sequence[Any], _: Mapping[str, Any]) -> Any:
        value, start, stop = operands[0], _numbers(operands[1])[0], _numbers(operands[2])[0]
        return value[:, start:stop]

    def gather(operands: Sequence[Any], attributes: Mapping[str, Any]) -> Any:
        return jnp.take(jnp.asarray(operands[0]), operands[1], axis=attributes["axis"], mode="clip")

    more = {
        "Div": divide, "Reshape": reshape, "Slice": cut, "Gather": gather,
        "Unsqueeze": lambda v, _: jnp.expand_dims(v[0], tuple(_numbers(v[1]))),
        "Where": lambda v, _: jnp.where(v[0], v[1], v[2]),
        "Concat": lambda v, a: jnp.concatenate(list(v), axis=a["axis"]),
        "ReduceSum": lambda v, _: v[0].sum(axis=tuple(_numbers(v[1])), keepdims=True),
        "ReduceMin": lambda v, a: v[0].min(axis=tuple(a["axes"]), keepdims=True),
        "Transpose": lambda v, a: jnp.transpose(v[0], a["perm"]),
        "Cast": lambda v, a: v[0].astype(int if a["to"] is np.int64 else dtype),
    }  # fmt: skip

    def plain(function: Callable[..., Any]) -> Callable[..., Any]:
        return lambda operands, _: function(*operands)

    return {k: plain(f) for k, f in (one | two).items()} | more
