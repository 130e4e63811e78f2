"""What a report tells of one held body that remembers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from palpate.learning.plastic import HeldPaths
from palpate.surrogates.plastic import HeldBody
from palpate.validation.held import HeldValidation

__all__ = ["HeldChapter"]


@dataclass(frozen=True, eq=False)
class HeldChapter:
    """One body: what was learnt, the histories that it was judged by, and how good it is.

    Attributes
    ----------
    name : str
        Its heading.
    body : HeldBody
    test : HeldPaths
        Histories that were not learnt from.
    validation : HeldValidation
        Of `body` on `test`.
    settings, provenance : mapping, optional
        What the study declared, and where the histories come from.
    timings : mapping of str to float, optional
        Seconds of each stage.
    """

    name: str
    body: HeldBody
    test: HeldPaths
    validation: HeldValidation
    settings: Mapping[str, Any] = field(default_factory=dict)
    timings: Mapping[str, float] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)
