"""The page of a learnt body, for the body itself: bodies stand below pages, which therefore register from above.

`palpate` registers a function that loads the page when the first body asks for it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

__all__ = ["page_of", "register_page"]

_makers: list[Callable[[Any], str]] = []


def register_page(make: Callable[[Any], str]) -> None:
    """Let a function make the HTML page of every body from now on."""
    _makers[:] = [make]


def page_of(body: Any) -> str:
    """Return the HTML page of a body; the errors are those of the function that makes it."""
    (make,) = _makers
    return make(body)
