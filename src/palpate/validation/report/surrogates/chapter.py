"""What a report tells of one touched body."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from palpate.surrogates import TouchSurrogate
from palpate.validation.solves import TouchSolves
from palpate.validation.surrogate import SurrogateValidation

__all__ = ["SurrogateChapter"]


@dataclass(frozen=True, eq=False)
class SurrogateChapter:
    """One touched body: its surrogate, the solves that it has never seen, and how good it is.

    Attributes
    ----------
    name : str
        Its heading.
    surrogate : TouchSurrogate
    test : TouchSolves
        Unseen solves.
    validation : SurrogateValidation
        Of `surrogate` on `test`.
    settings, timings, provenance : mapping, optional
        As in a `Chapter`.
    """

    name: str
    surrogate: TouchSurrogate
    test: TouchSolves
    validation: SurrogateValidation
    settings: Mapping[str, Any] = field(default_factory=dict)
    timings: Mapping[str, float] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)
