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
    """Return a class of ``torch.autograd.Function`` whose ``apply(x, name)`` answers rows x (N, n) in double precision.

    `by_operators` answers the same by torch's operators.
    """
    energy = body.hand_energy
    known = not body.parameters  # further inputs have slopes that the kernels do not give
    directions = torch.tensor(np.array(energy.baseline.directions))

    def slope_of(name: str, x: Any) -> Any:
        """Return ∂U/∂x (N, n) or ∂F/∂x (N, 3, n), differentiable again."""
        slope = Answers.apply(x, SLOPES[name]) @ directions.T
        return -slope if name == "energy" else slope

    class Answers(torch.autograd.Function):  # type: ignore[misc, name-defined]
        """One of `SLOPES` at rows of inputs, by the kernels."""

        @staticmethod
        def forward(x: Any, name: str) -> Any:
            return torch.from_numpy(getattr(energy, name)(x.detach().numpy()))

        @staticmethod
        def setup_context(ctx: Any, inputs: tuple[Any, str], _output: Any) -> None:
            x, ctx.name = inputs
            ctx.save_for_backward(x)
            ctx.save_for_forward(x)

        @staticmethod
        def backward(ctx: Any, weights: Any) -> tuple[Any, None]:
            (x,) = ctx.saved_tensors
            if not (known and SLOPES[ctx.name]):
                return torch.func.vjp(lambda v: by_operators(ctx.name, v), x)[1](weights)[0], None
            slope = slope_of(ctx.name, x)
            return (
                weights[..., None] * slope
                if weights.ndim == 1
                else torch.einsum("ni,nij->nj", weights, slope)
            ), None

        @staticmethod
        def jvp(ctx: Any, step: Any, _name: None) -> Any:
            (x,) = ctx.saved_tensors
            if not (known and SLOPES[ctx.name]):
                return torch.func.jvp(lambda v: by_operators(ctx.name, v), (x,), (step,))[1]
            slope = slope_of(ctx.name, x)
            return (slope @ step[..., None])[..., 0] if ctx.name == "force" else (slope * step).sum(-1)

        @staticmethod
        def vmap(_info: Any, in_dims: tuple[int, None], x: Any, name: str) -> tuple[Any, int]:
            many = x.movedim(in_dims[0], 0)
            rows = Answers.apply(many.reshape(-1, many.shape[-1]), name)
            return rows.reshape(*many.shape[:2], *rows.shape[1:]), 0

    return Answers
