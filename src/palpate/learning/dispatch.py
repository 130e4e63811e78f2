"""`pp.learn`: whatever a sweep is of, made into something that can be touched."""

from __future__ import annotations

from typing import Any

from palpate.dataset import Dataset
from palpate.learning.bodies import TouchHistory, is_touched, learn_body
from palpate.learning.history import History
from palpate.learning.touch import learn_touch
from palpate.surrogates import TouchedBody, TouchModel

__all__ = ["learn_dataset"]


def learn_dataset(
    train: Dataset, **options: Any
) -> tuple[TouchModel, History] | tuple[TouchedBody, TouchHistory]:
    """Learn a dataset of solves by the kind of its body.

    Parameters
    ----------
    train : Dataset
        Of a beam under loads, or of a body pressed by a probe.
    **options
        Those of `palpate.learning.learn_touch` for a beam, of `palpate.learning.learn_body` for a pressed body.

    Returns
    -------
    TouchModel, History
        Of a beam: a body held at one node, and what its filter did.
    TouchedBody, TouchHistory
        Of a pressed body: touched anywhere, and how it was found.

    Raises
    ------
    UsageError
        If the data is of neither, or too small.
    """
    if isinstance(train, Dataset) and is_touched(train):
        return learn_body(train, **options)
    return learn_touch(train, **options)
