"""Checks of arguments: each returns the value in its plain form, or raises a `UsageError` with what, why and fix.

    finite    a real number that is neither infinite nor not-a-number
    positive  a finite number above zero
    fits      a number, or a whole number, between bounds
    one_of    a word among a few; the error offers the nearest
    shape     an array of real numbers of a given shape
    triple    three numbers along x, y and z

and `own_arrays`, which makes the arrays of a frozen dataclass read-only, and `did_you_mean`, the question that offers
the nearest choice wherever a name is mistyped, and `gather`, which tells several refusals at once.

Import the module and name it in the call, ``checks.positive("The radius", radius, "m")``: the verbs alone are too
common as names. `what` is the quantity's name as a sentence begins with it, with its article; `unit` is the SI unit
that the message names, empty for a pure number.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, TypeVar

from palpate.errors import UsageError

if TYPE_CHECKING:
    import numpy as np

__all__ = ["did_you_mean", "finite", "fits", "gather", "one_of", "own_arrays", "positive", "shape", "triple"]

T = TypeVar("T")

_SURE = 0.75  # how alike a mistyped word must be to one that merely stands for a choice


def finite(what: str, value: Any, unit: str = "") -> float:
    """Return a finite real number as a float; text such as ``"5 N"`` is refused."""
    number = _real(what, value, unit)
    if math.isfinite(number):
        return number
    raise UsageError(
        f"{what} is {_with_unit(number, unit)}.",
        why="It must be finite.",
        fix=f"Pass a finite number{_in(unit)}.",
    )


def positive(what: str, value: Any, unit: str = "", *, infinite: bool = False) -> float:
    """Return a positive real number as a float; `infinite` where infinity is a sensible value."""
    number = _real(what, value, unit)
    if number > 0 and (infinite or math.isfinite(number)):
        return number
    raise UsageError(
        f"{what} is {_with_unit(number, unit)}.",
        why=f"It must be positive{'' if infinite else ' and finite'}.",
        fix=f"Pass a positive number{_in(unit)}.",
    )


def fits(
    what: str,
    value: Any,
    unit: str = "",
    *,
    least: float | None = None,
    most: float | None = None,
    above: float | None = None,
    below: float | None = None,
    whole: bool = False,
) -> Any:
    """Return a finite number that lies between bounds, as a float or, where `whole`, as an int.

    It may meet the bounds `least` and `most`, and may not meet `above` and `below`. `whole` is for a count, an index or
    a seed, which True and False are not.
    """
    if whole and (isinstance(value, bool) or not isinstance(value, Integral)):
        inside = False
    else:
        value = int(value) if whole else finite(what, value, unit)
        inside = (
            (least is None or value >= least)
            and (most is None or value <= most)
            and (above is None or value > above)
            and (below is None or value < below)
        )
    if inside:
        return value
    bounds = [
        f"{word} {bound:g}"
        for word, bound in (("at least", least), ("above", above), ("at most", most), ("below", below))
        if bound is not None
    ]
    rule = ", ".join([*(["a whole number"] if whole else []), " and ".join(bounds)]).strip(", ")
    shown = repr(value) if whole else _with_unit(value, unit)
    raise UsageError(
        f"{what} is {shown}.", why=f"It must be {rule}{_in(unit)}.", fix=f"Pass {rule}{_in(unit)}."
    )


def one_of(what: str, value: Any, choices: Sequence[str]) -> str:
    """Return a word that is among the choices, spelt as they are; otherwise the error's message offers the nearest."""
    if isinstance(value, str) and value in choices:
        return value
    raise UsageError(
        f"{what} is {value!r}.",
        why=f"It is one of {', '.join(map(repr, choices))}.",
        fix=did_you_mean(value, choices, shown=repr, cutoff=0.5) or "Choose one of these.",
    )


def gather(calls: Iterable[Callable[[], T]]) -> list[T]:
    """Return what each call returns; each `UsageError` of theirs is told by one, so that all are mended at once."""
    results, refused = list[T](), dict[str, UsageError]()  # a refusal of several calls is told once
    for call in calls:
        try:
            results.append(call())
        except UsageError as error:
            refused |= {str(part): part for part in error.refusals or (error,)}
    if len(refused) == 1:
        raise next(iter(refused.values()))
    if refused:
        complaints = [f"{number}. {text}".replace("\n", "\n   ") for number, text in enumerate(refused, 1)]
        together = UsageError(f"{len(refused)} things are wrong:", why="\n".join(complaints))
        together.refusals = tuple(refused.values())
        raise together
    return results


def did_you_mean(
    word: Any,
    choices: Iterable[str],
    *,
    meant: Mapping[str, str] | None = None,
    shown: Callable[[str], str] = str,
    cutoff: float = 0.6,
) -> str:
    """Return a question that offers the choice nearest to a word, in whatever case; "" where none is near.

    `meant` has other words for choices: the word itself among them goes before all spelling, one spelt like it comes
    last. `shown` writes a choice as a person types it; `cutoff` is how alike words must be, from 0 to 1.
    """
    typed = str(word).strip().lower()
    by_word = {other.lower(): choice for other, choice in (meant or {}).items()}
    own = {choice.lower(): choice for choice in choices}
    near = [by_word[typed]] if typed in by_word else []
    for known, alike in ((own, cutoff), (by_word, max(cutoff, _SURE))):
        near += [known[name] for name in difflib.get_close_matches(typed, known, n=1, cutoff=alike)]
    return f"Did you mean {shown(near[0])}?" if near else ""


def shape(
    what: str,
    value: Any,
    wanted: tuple[int | None, ...],
    unit: str = "",
    *,
    why: str = "",
    infinite: bool = False,
) -> np.ndarray:
    """Return an array of real numbers of a given shape, in double precision; one that is so already is not copied.

    `wanted` is the length along each axis, None for any above zero. `what` is the array's name in the singular, and
    `why` a sentence for the message on what rows and columns mean. `infinite` lets infinities and not-a-number through.
    """
    import numpy as np  # the command line checks its options without arrays

    form = f"({', '.join('any' if n is None else str(n) for n in wanted)}{',' if len(wanted) == 1 else ''})"
    try:
        array = np.asarray(value)
    except ValueError:  # rows of different lengths
        array = np.asarray(None)
    if array.dtype.kind not in "fiu" and array.size:
        strange = [x for x in np.asarray(value, dtype=object).ravel() if not isinstance(x, Real)]
        reason = f"It holds {strange[0]!r:.40}, of type {type(strange[0]).__name__}." if strange else ""
        raise UsageError(
            f"{what} does not consist of real numbers: {value!r:.80}.",
            why=reason or why or "Its rows differ in length.",
            fix=f"Pass an array of shape {form}{_in(unit)}.",
        )
    array = array.astype(np.float64, copy=False)
    if array.ndim != len(wanted) or any(
        n == 0 if m is None else n != m for n, m in zip(array.shape, wanted, strict=True)
    ):
        raise UsageError(
            f"{what} has shape {array.shape}; {form} is needed.",
            why=why,
            fix=f"Pass an array of that shape{_in(unit)}.",
        )
    if not infinite and not np.isfinite(array).all():
        place = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise UsageError(
            f"{what} holds {array[place]:g} at index {place[0] if len(place) == 1 else place}.",
            why="It must be finite: often a division by zero, or a gap in a table.",
            fix=f"Pass finite numbers{_in(unit)}.",
        )
    return array


def own_arrays(value: object, *names: str, dtype: Any = "float64") -> None:
    """Replace arrays of a frozen dataclass, by their names, by read-only, C-ordered copies; None stays None.

    A ``__post_init__`` calls it, so that nobody can change the value from outside.
    """
    import numpy as np

    for name in names:
        if getattr(value, name) is None:
            continue
        array = np.array(getattr(value, name), dtype=dtype, order="C")
        array.flags.writeable = False
        object.__setattr__(value, name, array)


def triple(what: str, value: Any, unit: str = "") -> tuple[float, float, float]:
    """Return three finite numbers along x, y and z as a tuple of floats."""
    x, y, z = shape(what, value, (3,), unit, why="It needs three numbers, along x, y and z.").tolist()
    return x, y, z


def _real(what: str, value: Any, unit: str) -> float:
    if isinstance(value, Real):
        return float(value)
    raise UsageError(
        f"{what} is {value!r}, of type {type(value).__name__}.",
        why=f"In Python it is a number{_in(unit)}; units in words are for study files.",
        fix="Pass numbers in SI units, for example 0.3 for 300 mm, 5 for 5 N or 70e9 for 70 GPa.",
    )


def _with_unit(number: float, unit: str) -> str:
    return f"{number:g} {unit}".rstrip()


def _in(unit: str) -> str:
    return f" in {unit}" if unit else ""
