"""One held pad at a time, without allocation: what the 1 kHz path calls."""

from __future__ import annotations

from collections.abc import Callable

from palpate.surrogates.grasp.kernels import grasp_into
from palpate.surrogates.surrogate_evaluator import SurrogateEvaluator

__all__ = ["GraspEvaluator"]


class GraspEvaluator(SurrogateEvaluator):
    """Evaluates one displacement at a time into arrays it owns; one evaluator serves one thread at a time.

    Made by `GraspSurrogate.evaluator`. Called with a displacement d (3,) in m and parameters, the place first; then
    `force`, `stiffness`, `energy` and `inside` are those of the pad there, `depth` is ‖d‖. Moving the place while d is
    held changes the energy, by no work of the hand: to hold elsewhere is a new grasp.
    """

    _kernel: Callable[..., bool] = staticmethod(grasp_into)

    def __repr__(self) -> str:
        where = "inside" if self.inside else "outside"
        return f"GraspEvaluator: force {self.force} N, displaced by {self.depth:.4g} m, {where} the trained region"
