"""A vendor's library as its driver uses it: where it lies, and its functions, with their types, by name."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Self

from palpate.devices.surroundings import Surroundings
from palpate.errors import DeviceError

__all__ = ["LibraryPlaces", "Signatures", "VendorLibrary"]

Signatures = Mapping[str, tuple[Any, tuple[Any, ...]]]
"""Type of the result and types of the arguments of each function, by its name."""

_PATHS = {"linux": ("LD_LIBRARY_PATH",), "darwin": ("DYLD_LIBRARY_PATH",), "win32": ("PATH",)}
_SYSTEM = {
    "linux": ("/usr/local/lib", "/usr/local/lib64", "/usr/lib/*-linux-gnu", "/usr/lib64", "/usr/lib"),
    "darwin": ("/usr/local/lib", "/opt/homebrew/lib"),
}


@dataclass(frozen=True)
class LibraryPlaces:
    """Where a vendor's library is looked for."""

    family: str  # of devices, in words
    device: str  # name of the driver
    files: Mapping[str, tuple[str, ...]]  # file names by platform, the preferred one first
    # where the vendor's installer puts it, beside the system's own; may hold wildcards
    folders: tuple[str, ...]
    # environment variables that name a folder of the vendor's kit; its lib* are looked in
    variables: tuple[str, ...]
    override: str  # environment variable that names the file itself, or its folder
    download: str  # title of what the vendor offers

    def names(self, platform: str) -> tuple[str, ...]:
        """Return the names that the file may have."""
        return self.files.get(platform, self.files["linux"])

    def looked_in(self, platform: str) -> tuple[str, ...]:
        """Return the variables and folders that are looked in."""
        named = (self.override, *self.variables, *_PATHS.get(platform, ()))
        return (*(f"${v}" for v in named), *self.folders, *_SYSTEM.get(platform, ()))

    def find(self, surroundings: Surroundings) -> Path | None:
        """Return the library's file, or None where there is none."""
        if given := surroundings.environment.get(self.override):
            place = surroundings.place(given)
            if place.is_file():
                return place
        files = (f / name for f in self._folders(surroundings) for name in self.names(surroundings.platform))
        return next((file for file in files if file.is_file()), None)

    def _folders(self, surroundings: Surroundings) -> Iterator[Path]:
        environment = surroundings.environment
        if given := environment.get(self.override):
            yield surroundings.place(given)
        for variable in self.variables:
            if base := environment.get(variable):
                kit = surroundings.place(base)
                yield from (kit, *kit.glob("lib*"), *kit.glob("lib*/*"), *kit.glob("lib*/*/*"))
        separator = ";" if surroundings.platform == "win32" else ":"
        for variable in _PATHS.get(surroundings.platform, ()):
            for part in filter(None, environment.get(variable, "").split(separator)):
                yield surroundings.place(part)
        for pattern in (*self.folders, *_SYSTEM.get(surroundings.platform, ())):
            yield from sorted(surroundings.root.glob(pattern.lstrip("/")))

    def load(self, file: str = "", surroundings: Surroundings | None = None) -> ctypes.CDLL:
        """Load the library; an empty `file` looks for it. A DeviceError names what was tried, and what to do."""
        surroundings = surroundings or Surroundings()
        path = Path(file) if file else self.find(surroundings)
        install = f"Install {self.download}, or name its library in the environment variable {self.override}"
        if path is None or not path.is_file():
            names, places = (f(surroundings.platform) for f in (self.names, self.looked_in))
            raise DeviceError(
                f"The library of {self.family} is not there{f': {file}' if file else ''}.",
                why="" if file else f"Looked for {', '.join(names)} in {', '.join(places)}.",
                fix=f"{install} or with --device {self.device}:library=FILE.",
            )
        try:
            return ctypes.CDLL(str(path))
        except OSError as error:
            raise DeviceError(
                f"The library of {self.family} can't be loaded: {path}.",
                why=str(error),
                fix=f"It may be of another processor, or lack libraries that come with it. {install}.",
            ) from error


class VendorLibrary:
    """The library's functions, with their types, as attributes.

    A kind has its `places`. The driver needs the functions of `signatures`, of which a missing one is a DeviceError,
    and can do without those of `extra`; see `has`.
    """

    places: ClassVar[LibraryPlaces]
    signatures: ClassVar[Signatures]
    extra: ClassVar[Signatures] = {}

    def __init__(self, library: ctypes.CDLL) -> None:
        self._functions: dict[str, Callable[..., Any]] = {}
        for name, (result, arguments) in (dict(self.signatures) | dict(self.extra)).items():
            function = getattr(library, name, None)
            if function is not None:
                function.restype, function.argtypes = result, arguments
                self._functions[name] = function
        if missing := self.signatures.keys() - self._functions.keys():
            raise DeviceError(
                f"The library {library._name} lacks {', '.join(sorted(missing))}.",
                fix=f"Install {self.places.download}.",
            )

    @classmethod
    def load(cls, file: str) -> Self:
        """Load the library from a file; an empty one is looked for."""
        return cls(cls.places.load(file))

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
