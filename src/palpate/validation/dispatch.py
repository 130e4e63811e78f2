"""`validate`: whatever was learnt against solves that it has never seen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import overload

from palpate.dataset import Dataset
from palpate.errors import UsageError
from palpate.learning import History
from palpate.surrogates import TouchedBody, TouchModel, TouchSurrogate
from palpate.surrogates.grasp import GraspSurrogate
from palpate.validation.judgement import Judgement
from palpate.validation.limits import Limits
from palpate.validation.result import Validation, validate_model
from palpate.validation.solves import TouchFunction, TouchSolves
from palpate.validation.surrogate import SurrogateValidation, validate_surrogate

__all__ = ["validate"]


@overload
def validate(
    model: TouchModel, test: Dataset, *, history: History | None = None, limits: Limits | None = None
) -> Validation: ...


@overload
def validate(
    model: TouchedBody | TouchSurrogate | GraspSurrogate | TouchFunction,
    test: Dataset | TouchSolves,
    *,
    refined: Dataset | TouchSolves | None = None,
    strokes: Sequence[TouchSolves] = (),
    limits: Limits | None = None,
    seed: int = 0,
) -> SurrogateValidation: ...


def validate(
    model: TouchModel | TouchedBody | TouchSurrogate | GraspSurrogate | TouchFunction,
    test: Dataset | TouchSolves,
    *,
    history: History | None = None,
    refined: Dataset | TouchSolves | None = None,
    strokes: Sequence[TouchSolves] = (),
    limits: Limits | None = None,
    seed: int = 0,
) -> Judgement:
    """Judge a model by solves that it has never seen, in units that a person feels.

    Parameters
    ----------
    model : TouchModel, TouchedBody, TouchSurrogate, GraspSurrogate or TouchFunction
        A body held at one node; a body touched anywhere, with its shape or without; any force as a function of the
        probe's centre.
    test : Dataset or TouchSolves
        Rows that did not converge are left out. `TouchSolves` holds arrays.
    history : History, optional
        Of a touch model's filter; its held-out error tells whether it was stable.
    refined : Dataset or TouchSolves, optional
        For a touched body: places solved with half the element size, which tell the mesh's own error.
    strokes : sequence of TouchSolves, optional
        For a touched body: solves along strokes, beside which smoothness is judged.
    limits : Limits, optional
        By default what a person can notice.
    seed : int
        For a touched body: of the random strokes and loops.

    Returns
    -------
    Validation or SurrogateValidation
        Printed a table; `passed`, `checks`, `raise_if_failed()`, `as_dict()`.

    Raises
    ------
    UsageError
        If the solves are of another body, or of no use as a test.
    """
    if not isinstance(test, Dataset | TouchSolves):
        raise UsageError(
            f"A model is judged by solves, not by {type(test).__name__} {test!r:.60}.",
            fix="Give what `palpate.sweep` returned, `Dataset.open(path)`, or TouchSolves of arrays.",
        )
    if isinstance(model, TouchModel):
        if not isinstance(test, Dataset) or refined is not None or strokes:
            raise UsageError(
                "A touch model of a held body is judged by a dataset of its study alone.",
                fix="Give a Dataset, without `refined` and `strokes`.",
            )
        return validate_model(model, test, history=history, limits=limits)
    if history is not None:
        raise UsageError("A touched body's model has no history of a filter.", fix="Leave `history` out.")
    return validate_surrogate(model, test, refined=refined, strokes=strokes, limits=limits, seed=seed)
