"""palpate's compiled kernels as a function of torch tensors, with the derivatives that they know themselves.

The kernels answer energy, force and stiffness together, and −F is the slope of U, ∂F/∂x that of F. So a gradient of the
energy costs a force, and a gradient of the force a stiffness. What the kernels do not know (third derivatives, slopes
by a body's further inputs) is left to torch's own operators.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from palpate.surrogates import Surrogate

__all__ = ["SLOPES", "kernel_function"]

SLOPES = {"energy": "force", "force": "stiffness", "stiffness": ""}
"""Answers of the kernels, and which of them holds the slope of each."""


def kernel_function(torch: Any, body: Surrogate, by_operators: Callable[[str, Any], Any]) -> Any:
    """Return a class of ``torch.autograd.Function`` that answers rows x (N, n) in double precision.

    ``apply(x, name)`` gives the answer and, for the first derivative, the answer that holds its slope. `by_operators`
    answers the same by torch's operators.
    """
    energy = body.hand_energy
    known = not body.parameters  # further inputs have slopes that the kernels do not give
    directions = torch.tensor(np.array(energy.baseline.directions))

    def slope_of(ctx: Any, x: Any, there: Any) -> Any:
        """Return ∂U/∂x (N, n) or ∂F/∂x (N, 3, n), differentiable again where that is asked for."""
        answer = Answers.apply(x, SLOPES[ctx.name])[0] if torch.is_grad_enabled() else there
        return -(answer @ directions.T) if ctx.name == "energy" else answer @ directions.T

    class Answers(torch.autograd.Function):  # type: ignore[misc, name-defined]
        """One of `SLOPES` at rows of inputs, by the kernels, and the next."""

        @staticmethod
        def forward(x: Any, name: str) -> tuple[Any, Any]:
            answers = dict(zip(SLOPES, energy.response(x.detach().numpy()), strict=True))
            slope = answers.get(SLOPES[name], np.empty(0))
            return torch.from_numpy(answers[name]), torch.from_numpy(slope)

        @staticmethod
        def setup_context(ctx: Any, inputs: tuple[Any, str], output: tuple[Any, Any]) -> None:
            x, ctx.name = inputs
            ctx.mark_non_differentiable(output[1])
            ctx.save_for_backward(x, output[1])
            ctx.save_for_forward(x, output[1])

        @staticmethod
        def backward(ctx: Any, weights: Any, _slope: Any) -> tuple[Any, None]:
            x, there = ctx.saved_tensors
            if not (known and SLOPES[ctx.name]):
                return torch.func.vjp(lambda v: by_operators(ctx.name, v), x)[1](weights)[0], None
            slope = slope_of(ctx, x, there)
            return (
                weights[:, None] * slope if weights.ndim == 1 else torch.einsum("ni,nij->nj", weights, slope)
            ), None

        @staticmethod
        def jvp(ctx: Any, step: Any, _name: None) -> tuple[Any, None]:
            x, there = ctx.saved_tensors
            if not (known and SLOPES[ctx.name]):
                return torch.func.jvp(lambda v: by_operators(ctx.name, v), (x,), (step,))[1], None
            slope = slope_of(ctx, x, there)
            return (
                (slope @ step[..., None])[..., 0] if ctx.name == "force" else (slope * step).sum(-1)
            ), None

        @staticmethod
        def vmap(
            _info: Any, in_dims: tuple[int, None], x: Any, name: str
        ) -> tuple[tuple[Any, Any], tuple[int, int]]:
            many = x.movedim(in_dims[0], 0)
            rows, slopes = Answers.apply(many.reshape(-1, many.shape[-1]), name)
            shape = many.shape[:2] if SLOPES[name] else (many.shape[0], 0)
            return (
                rows.reshape(*many.shape[:2], *rows.shape[1:]),
                slopes.reshape(*shape, *slopes.shape[1:]),
            ), (0, 0)

    return Answers
