"""Warnings: what is allowed, and yet hardly meant."""

from __future__ import annotations

import sys
import warnings

__all__ = ["ModelWarning", "advise"]


class ModelWarning(UserWarning):
    """A model that can be solved, but whose answer is probably not the one that is wanted.

    Told once, when a body or a problem is made, never by a solve. Those who mean it silence it with
    ``warnings.simplefilter("ignore", ModelWarning)``.
    """


def advise(what: str, *, why: str, fix: str) -> None:
    """Warn, at the line outside of palpate that led here.

    Parameters
    ----------
    what : str
        What is odd, as one sentence.
    why : str
        What comes of it.
    fix : str
        What the reader can do about it.
    """
    level, frame = 2, sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__name__", "").startswith("palpate"):
        level, frame = level + 1, frame.f_back
    warnings.warn("\n".join((what, why, fix)), ModelWarning, stacklevel=level)
