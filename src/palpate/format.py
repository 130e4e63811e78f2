"""Numbers as text for people: few digits, a fitting unit, a proper minus sign; and values as data for JSON."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from palpate.units import Range

__all__ = [
    "bind_units",
    "bound",
    "by_number",
    "count",
    "criterion_figure",
    "duration",
    "interval",
    "length",
    "millimetres",
    "number",
    "plain",
    "power_of_ten",
    "pressure",
    "scientific",
    "script_json",
    "share",
    "span",
    "summary_figure",
    "with_interval",
]

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_PRESSURES = ((1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa"), (1.0, "Pa"))
_LENGTHS = ((1.0, "m"), (1e-3, "mm"), (1e-6, "µm"), (1e-9, "nm"))


def plain(value: float, digits: int = 2) -> str:
    """Write a number with `digits` significant digits and no trailing zeros: 1234, 0.012, 3.4 × 10⁻⁷."""
    if not math.isfinite(value):
        return "not a number" if math.isnan(value) else "infinite"
    if value == 0:
        return "0"
    if not 1e-3 <= abs(value) < 1e6:
        return scientific(value, digits)
    decimals = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    text = f"{value:.{decimals}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def script_json(text: str) -> str:
    """Write a JSON text so that it may stand in a script of an HTML page: the same value, and no mark of HTML's."""
    return re.sub("[<>&\u2028\u2029]", lambda mark: f"\\u{ord(mark[0]):04x}", text)


def scientific(value: float, digits: int = 2) -> str:
    """Write a number as 3.4 × 10⁻⁷."""
    if not math.isfinite(value) or value == 0:
        return plain(value)
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    return f"{mantissa} × 10{str(int(exponent)).translate(_RAISED)}"


def power_of_ten(value: float) -> str:
    """Write a power of ten as 10⁻³, but 1 and 10 as they are."""
    exponent = round(math.log10(value)) if value > 0 else 0
    return {0: "1", 1: "10"}.get(exponent, f"10{str(exponent).translate(_RAISED)}")


def bind_units(text: str) -> str:
    """Join each number in a text to its unit by a no-break space, and set proper minus signs."""
    text = re.sub(r"(?<![\w-])-(?=\d)", "−", text)
    text = text.replace(" × 10", "\N{NO-BREAK SPACE}×\N{NO-BREAK SPACE}10")
    text = text.replace(" = ", "\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}")
    return re.sub(
        r"(?<=[\d⁰¹²³⁴-⁹]) (?=(?:[nµm]?m|[GMk]?Pa|N|m?s|min|units?|×)\b|[%×])", "\N{NO-BREAK SPACE}", text
    )


def count(number: int, singular: str, plural: str = "") -> str:
    """Write a number of things: 1 unit, 1,255 observations."""
    return f"{number:,} {singular if number == 1 else plural or singular + 's'}"


def by_number(singular: str, numbers: Sequence[int], shown: int = 5) -> str:
    """Write things of one kind by their numbers: line 3, or lines 3, 7, 19; … stands for those beyond `shown`."""
    listed = ", ".join(str(number) for number in numbers[:shown])
    return f"{singular}{'s' * (len(numbers) > 1)} {listed}{', …' * (len(numbers) > shown)}"


def length(metres: float) -> str:
    """Write a length in the unit that gives the shortest number."""
    size = abs(metres)
    if not math.isfinite(size) or size == 0:
        return f"{plain(metres)} m"
    factor, unit = next((u for u in _LENGTHS if size >= 0.9995 * u[0]), _LENGTHS[-1])
    return f"{plain(metres / factor, 3)} {unit}"


def interval(extent: Range) -> str:
    """Write a range, with lengths below 1 m in mm: c_z 42.7 … 49.8 mm."""
    low, high, unit = extent.low, extent.high, extent.unit
    if unit == "m" and max(abs(low), abs(high)) < 1.0:
        low, high, unit = low / 1e-3, high / 1e-3, "mm"
    return f"{extent.name} {plain(low, 3)} … {plain(high, 3)} {unit}".rstrip()


def pressure(pascals: float) -> str:
    """Write a modulus in GPa, MPa, kPa or Pa."""
    factor, unit = next((u for u in _PRESSURES if pascals >= 0.9995 * u[0]), _PRESSURES[-1])
    return f"{plain(pascals / factor, 3)} {unit}"


def share(value: float) -> str:
    """Write a ratio in per cent."""
    return f"{plain(100 * value)} %"


def duration(seconds: float) -> str:
    """Write a time in s or ms, or in minutes above two of them."""
    if seconds >= 120:
        return f"{plain(seconds / 60)} min"
    return f"{plain(seconds)} s" if seconds >= 1 else f"{plain(1e3 * seconds)} ms"


def criterion_figure(value: float | tuple[float, float], kind: str) -> str:
    """Write a figure, or the two ends of a band, by the kind of its `palpate.validation.limits.Criterion`."""
    if isinstance(value, tuple):
        return " … ".join(criterion_figure(end, kind) for end in value)
    if kind == "scale":
        return scientific(value)
    if kind == "metres":
        return length(value)
    if kind == "share":
        return share(value)
    return f"{plain(value, 3)}°" if kind == "degrees" else f"{plain(value, 3)} ×"


def summary_figure(name: str, value: object) -> object:
    """Write a figure of a model's own record by its name, as the table of limits writes it; others stay as they are.

    Errors are written in per cent, errors over full scale as powers of ten.
    """
    if isinstance(value, bool) or not isinstance(value, float):
        return value
    if "full scale" in name:
        return scientific(value)
    return share(value) if name.startswith("force error") or name in _LEFT_OUT else value


_LEFT_OUT = ("median", "p95")  # statistics of the force errors on solves left out while learning


def number(value: float, digits: int = 4) -> str:
    """Write a number with `digits` digits at most: 0.05, 1e+04; what rounds to zero has no sign."""
    return f"{value + 0.0:.{digits}g}"


def with_interval(value: float, low: float, high: float) -> str:
    """Write a value with its interval, with the digits that tell its ends apart: 1999.9 (1999.6 to 2000.2)."""
    size = max(abs(value), abs(low), abs(high))
    digits = 3
    if math.isfinite(size) and high > low:
        digits = min(15, max(3, _order(size) - _order(high - low) + 2))
    if 0.0 < size < 1e6:  # no exponent where a person counts digits
        digits = max(digits, _order(size) + 1)
    return f"{number(value, digits + 1)} ({number(low, digits)} to {number(high, digits)})"


def _order(size: float) -> int:
    """Return the power of ten of the first digit of a positive number."""
    return math.floor(math.log10(size))


def bound(value: float, digits: int = 2, *, least: bool = False) -> float:
    """Return a positive number rounded down to some digits, so that it may be told as a most, or up as a least."""
    unit = 10.0 ** (math.floor(math.log10(value)) - digits + 1)
    steps = value / unit
    whole = round(steps)
    if abs(steps - whole) > 1e-9 * steps:
        whole = math.ceil(steps) if least else math.floor(steps)
    return float(f"{whole * unit:.{digits + 2}g}")


def millimetres(*lengths: float) -> str:
    """Write lengths given in m, in mm: 100 × 100 × 50 mm."""
    return " × ".join(number(1e3 * value) for value in lengths) + " mm"


def span(ends: float | tuple[float, float], unit: str) -> str:
    """Write a value that stays, or the ends between which it varies: 0 … 5 N."""
    if isinstance(ends, tuple):
        return " … ".join(map(number, ends)) + f" {unit}"
    return f"{number(ends)} {unit}"
