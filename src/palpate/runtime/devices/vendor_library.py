"""A vendor's library as its driver uses it: functions with their types, by name."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping
from typing import Any

from palpate.errors import DeviceError

__all__ = ["Signatures", "VendorLibrary"]

Signatures = Mapping[str, tuple[Any, tuple[Any, ...]]]
"""Type of the result and types of the arguments of each function, by its name."""


class VendorLibrary:
    """The library's functions, with their types, as attributes.

    The driver needs those of `signatures`, of which a missing one is a DeviceError with `install`, what to do about it,
    and can do without those of `extra`; see `has`.
    """

    def __init__(
        self, library: ctypes.CDLL, signatures: Signatures, *, extra: Signatures | None = None, install: str
    ) -> None:
        self._functions: dict[str, Callable[..., Any]] = {}
        for name, (result, arguments) in (dict(signatures) | dict(extra or {})).items():
            function = getattr(library, name, None)
            if function is not None:
                function.restype, function.argtypes = result, arguments
                self._functions[name] = function
        if missing := signatures.keys() - self._functions.keys():
            raise DeviceError(f"The library {library._name} lacks {', '.join(sorted(missing))}.", fix=install)

    def __getattr__(self, name: str) -> Callable[..., Any]:
        try:
            return self._functions[name]
        except KeyError as error:
            raise AttributeError(name) from error

    def has(self, name: str) -> bool:
        """Return whether the library has a function."""
        return name in self._functions

    def addresses(self) -> dict[str, int]:
        """Return the address of each function."""
        return {
            name: ctypes.cast(function, ctypes.c_void_p).value or 0  # type: ignore[arg-type]
            for name, function in self._functions.items()
        }
