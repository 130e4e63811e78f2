"""Options of a device, each declared once: its default, what it may be, and how people write it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, field, fields
from typing import Any, ClassVar, TypeVar

from palpate.checks import did_you_mean
from palpate.errors import UsageError
from palpate.units import parse_quantity

__all__ = ["DeviceOptions", "number", "settings_from", "switch", "word"]

_Settings = TypeVar("_Settings")


@dataclass(frozen=True)
class _Allowed:
    """The values that an option may have, and their words."""

    holds: Callable[[Any], bool]
    words: str


def number(
    default: float,
    least: float = -math.inf,
    most: float = math.inf,
    *,
    above: bool = False,
    whole: bool = False,
    also: float | None = None,
) -> Any:
    """Declare a finite number from `least`, or `above` it, to `most`; `also` is one more that has its own meaning."""

    def holds(value: float) -> bool:
        inside = math.isfinite(value) and least <= value <= most and not (above and value == least)
        return value == also or (inside and (not whole or value == int(value)))

    low = f"{'above' if above else 'at least'} {least:g}"
    bounds = [low] * math.isfinite(least) + [f"at most {most:g}"] * math.isfinite(most)
    words = f"{'a whole' if whole else 'a'} number {' and '.join(bounds)}".rstrip()
    return _declare(default, holds, words + (f", or {also:g}" if also is not None else ""))


def switch(default: float) -> Any:
    """Declare a number that is 0 or 1."""
    return _declare(default, lambda value: value in {0.0, 1.0}, "0 or 1")


def word(default: str, *others: str, meaning: str = "a text that is not empty") -> Any:
    """Declare one of some words; without others any text that is not empty, of this `meaning`."""
    choices = (default, *others)
    if not others:
        return _declare(default, bool, meaning)
    return _declare(default, lambda value: value in choices, f"one of {', '.join(choices)}")


def _declare(default: Any, holds: Callable[[Any], bool], words: str) -> Any:
    return field(default=default, metadata={"allowed": _Allowed(holds, words)})


@dataclass(frozen=True)
class DeviceOptions:
    """Options of a `driver`; each must be what it was declared to be."""

    driver: ClassVar[str]

    def __post_init__(self) -> None:
        for option in fields(self):
            allowed, value = option.metadata.get("allowed"), getattr(self, option.name)
            if allowed is not None and not allowed.holds(value):
                raise self.refusal(f"{option.name}={value}", f"{option.name} is {allowed.words}.")

    def refusal(self, options: str, allowed: str) -> UsageError:
        """Return the error that says which options can't be, and what they may be."""
        return UsageError(f"An option of {self.driver} is out of range: {options}.", fix=allowed)


def settings_from(kind: type[_Settings], options: Mapping[str, str]) -> _Settings:
    """Build a device's settings dataclass, whose fields are numbers or words, from texts."""
    defaults = {f.name: f.default for f in fields(kind) if f.default is not MISSING}  # type: ignore[arg-type]
    values: dict[str, Any] = {}
    for name, text in options.items():
        if name.startswith("ws:") and "url" in defaults:
            name, text = "url", name
        if name not in defaults:
            raise UsageError(
                f"The device has no option {name!r}.",
                why=f"Its options are {', '.join(defaults) or 'none'}.",
                fix=did_you_mean(name, defaults) or "Write name=value, with commas between options.",
            )
        is_text = isinstance(defaults[name], str)
        values[name] = text if is_text else parse_quantity(text, "", f"The device option {name}")
    return kind(**values)
