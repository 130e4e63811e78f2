"""Learnt bodies that come with palpate, to be examined for lumps; `benchmarks/shipped_bodies.py` makes them."""

from __future__ import annotations

from pathlib import Path

from palpate import checks
from palpate.network.codec import load_value
from palpate.surrogates.surrogate import KIND, Surrogate

__all__ = ["SHIPPED", "shipped_body"]

SHIPPED = {
    "breast": "a dome of glandular tissue, ⌀100 mm and 40 mm high, on its base",
    "prostate": "a block of prostatic tissue, 50 by 40 by 30 mm",
    "skin": "3 mm of skin, 12 mm of fat and 15 mm of muscle, 60 by 60 mm",
}
"""Names of the bodies, and what each is."""

FOLDER = Path(__file__).with_name("shipped")


def shipped_body(name: str) -> Surrogate:
    """Return a learnt body that comes with palpate, which takes lumps by `Surrogate.with_lumps`.

    Parameters
    ----------
    name : {"breast", "prostate", "skin"}
        Which one; `SHIPPED` says what they are. They are geometries and moduli of tissue in the literature, no
        person's.

    Raises
    ------
    UsageError
        If there is none of that name.
    """
    checks.one_of("The shipped body", name, tuple(SHIPPED))
    return load_value(FOLDER / f"{name}.palpate", Surrogate, kind=KIND, noun="a body")
