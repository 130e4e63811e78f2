"""Figures as a person reads them."""

from __future__ import annotations

import math
import re

from palpate.units import Range

__all__ = [
    "bound",
    "count",
    "duration",
    "interval",
    "length",
    "plain",
    "power_of_ten",
    "pressure",
    "scientific",
    "share",
    "shown",
]

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_PRESSURES = ((1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa"), (1.0, "Pa"))
_LENGTHS = ((1.0, "m"), (1e-3, "mm"), (1e-6, "µm"), (1e-9, "nm"))


def plain(value: float, digits: int = 2) -> str:
    """A number with significant digits, without trailing zeros: 1234, 0.012, 3.4 × 10⁻⁷."""
    if not math.isfinite(value):
        return "not a number" if math.isnan(value) else "infinite"
    if value == 0:
        return "0"
    if not 1e-3 <= abs(value) < 1e6:
        return scientific(value, digits)
    decimals = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    text = f"{value:.{decimals}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def scientific(value: float, digits: int = 2) -> str:
    """A number as 3.4 × 10⁻⁷."""
    if not math.isfinite(value) or value == 0:
        return plain(value)
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    return f"{mantissa} × 10{str(int(exponent)).translate(_RAISED)}"


def power_of_ten(value: float) -> str:
    """A power of ten as 10⁻³, and 1 and 10 as they are."""
    exponent = round(math.log10(value)) if value > 0 else 0
    return {0: "1", 1: "10"}.get(exponent, f"10{str(exponent).translate(_RAISED)}")


def bound(text: str) -> str:
    """A text whose numbers no line break parts from their unit, with proper minus signs."""
    text = re.sub(r"(?<![\w-])-(?=\d)", "−", text)
    text = text.replace(" × 10", "\N{NO-BREAK SPACE}×\N{NO-BREAK SPACE}10")
    text = text.replace(" = ", "\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}")
    return re.sub(
        r"(?<=[\d⁰¹²³⁴-⁹]) (?=(?:[nµm]?m|[GMk]?Pa|N|m?s|min|units?|×)\b|[%×])", "\N{NO-BREAK SPACE}", text
    )


def count(number: int, one: str, many: str = "") -> str:
    """So many things: 1 unit, 1,255 observations."""
    return f"{number:,} {one if number == 1 else many or one + 's'}"


def length(metres: float) -> str:
    """A length in the unit that gives the shortest number."""
    size = abs(metres)
    if not math.isfinite(size) or size == 0:
        return f"{plain(metres)} m"
    factor, unit = next((u for u in _LENGTHS if size >= 0.9995 * u[0]), _LENGTHS[-1])
    return f"{plain(metres / factor, 3)} {unit}"


def interval(of: Range) -> str:
    """A range, lengths below 1 m in mm: c_z 42.7 … 49.8 mm."""
    small = of.unit == "m" and max(abs(of.low), abs(of.high)) < 1.0
    factor, unit = (1e-3, "mm") if small else (1.0, of.unit)
    return f"{of.name} {plain(of.low / factor, 3)} … {plain(of.high / factor, 3)} {unit}".rstrip()


def pressure(pascals: float) -> str:
    """A modulus in GPa, MPa, kPa or Pa."""
    factor, unit = next((u for u in _PRESSURES if pascals >= 0.9995 * u[0]), _PRESSURES[-1])
    return f"{plain(pascals / factor, 3)} {unit}"


def share(value: float) -> str:
    """A ratio in per cent."""
    return f"{plain(100 * value)} %"


def duration(seconds: float) -> str:
    """A time in s or ms, minutes above two."""
    if seconds >= 120:
        return f"{plain(seconds / 60)} min"
    return f"{plain(seconds)} s" if seconds >= 1 else f"{plain(1e3 * seconds)} ms"


def shown(value: float | tuple[float, float], kind: str) -> str:
    """A figure, or the two ends of a band, of one of the kinds of `palpate.validation.limits.Criterion`."""
    if isinstance(value, tuple):
        return " … ".join(shown(end, kind) for end in value)
    if kind == "scale":
        return scientific(value)
    if kind == "metres":
        return length(value)
    if kind == "share":
        return share(value)
    return f"{plain(value, 3)}°" if kind == "degrees" else f"{plain(value, 3)} ×"
