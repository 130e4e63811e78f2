"""The one codec between frozen dataclasses and files: it knows fields and their types, not kinds of things.

    save_value(path, surrogate, kind="surrogate")
    load_value(path, Surrogate, kind="surrogate", noun="a surrogate")

A dataclass opts in by its annotations alone: each field that ``__init__`` takes has one of the types

    float                     any number, infinite and not-a-number included
    int, bool, str, Literal   exactly these
    X | None                  the value or nothing
    np.ndarray                of float64; ``Annotated[np.ndarray, np.int64]`` or ``…, np.bool_`` of another type
    Network                   its own description, bit for bit
    a dataclass               nested, field by field
    tuple[X, ...]             of any of these; tuple[X, Y] too
    Mapping[str, X]           of any of these by name
    Mapping[str, Any], Any    JSON, as it is: text, numbers, lists, dictionaries
    a base class or protocol  whatever `register_kind` was told may stand there, under its name
    X | Y of dataclasses      one of them, under its class's name

and its ``__post_init__`` refuses parts that do not fit each other, with `UsageError`: reading calls it too. What
several fields share (one surface for all fields of a body) is stored once and is one object again when read. Large
tables of smooth numbers are packed without loss.
The type decides what is read, so nothing in a file can choose a class that its reader did not ask for.
"""

from __future__ import annotations

import math
import os
import types
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Protocol, TypeVar, Union, get_args, get_origin, get_type_hints
from urllib.parse import quote

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.network.archive import Archive, load_archive, save_archive
from palpate.network.kinds import UnknownKindError, import_next, registered_kinds, registrations, same_class
from palpate.network.network import Network
from palpate.network.packing import pack, unpack

__all__ = ["decode", "encode", "load_value", "save_value"]

T = TypeVar("T")
_ALONE = "value"  # the name of what is stored where nothing contains it
# an array of so many bytes or more is packed where that saves a tenth
_LARGE, _WORTH, _PACKED = 50_000, 0.9, "packed"
_KIND, _SAME = "class", "same as"  # neither can be the name of a field
_NOT_FINITE = {"inf": math.inf, "-inf": -math.inf, "nan": math.nan}
_forms: dict[Any, Any] = {}


def encode(value: object, *, kind: str) -> Archive:
    """The archive of a dataclass (or of a network alone), to be written by `save_archive`.

    Parameters
    ----------
    value : dataclass or Network
        Its fields have the types above.
    kind : str
        What the file's header calls it.

    Raises
    ------
    UsageError
        If a field holds something else than it was declared to, or its type is none of these.
    """
    parts = _Parts()
    described = _form(type(value)).write(value, "", parts)
    return Archive(parts.networks, parts.arrays, described if isinstance(described, dict) else {}, kind)


def decode(cls: type[T], archive: Archive) -> T:
    """The value that an archive holds, bit for bit what `encode` was given.

    Parameters
    ----------
    cls : type
        What it is; the types of its fields say what must stand in the archive.
    archive : Archive
        As `load_archive` returns it.

    Raises
    ------
    KeyError, TypeError, ValueError, OverflowError, UsageError
        If anything is missing, too much or not what it must be. `load_value` makes one error of them.
    """
    parts = _Parts(dict(archive.networks), dict(archive.arrays))
    value: T = _form(cls).read(_ALONE if cls is Network else archive.meta, "", parts)
    if parts.networks or parts.arrays:
        raise ValueError(f"it holds {sorted([*parts.networks, *parts.arrays])}, which belong to nothing")
    return value


def save_value(path: str | os.PathLike[str], value: object, *, kind: str) -> Path:
    """Write a dataclass or a network to one file, which appears whole or not at all.

    Raises
    ------
    UsageError
        If the folder does not exist or can't be written, or the value holds what no file can.
    """
    return save_archive(path, encode(value, kind=kind))


def load_value(path: str | os.PathLike[str], cls: type[T], *, kind: str, noun: str) -> T:
    """Read a value back, bit for bit.

    Parameters
    ----------
    path : path
        The file.
    cls : type
        What the file must hold.
    kind : str
        What its header must call it.
    noun : str
        What an error calls it, such as "a surrogate".

    Raises
    ------
    FileFormatError
        If the file is missing, corrupt, foreign, of another kind or from a later version, or its parts do not fit.
    """
    archive = load_archive(path, kind=kind)
    try:
        return decode(cls, archive)
    except (KeyError, TypeError, ValueError, IndexError, OverflowError, UsageError) as error:
        raise FileFormatError(
            f"{path} does not describe {noun}.",
            why=f"{type(error).__name__}: {error}",
            fix=error.fix
            if isinstance(error, UnknownKindError)
            else "Copy the file again, or learn it anew.",
        ) from error


@dataclass
class _Parts:
    """Parts of an archive beside its JSON, and the places and values that were written or read already."""

    networks: dict[str, Network] = field(default_factory=dict)
    arrays: dict[str, np.ndarray] = field(default_factory=dict)
    places: dict[int, str] = field(default_factory=dict)
    values: dict[str, Any] = field(default_factory=dict)
    held: list[object] = field(default_factory=list)  # as long as its id is in use

    def first_place(self, value: object, path: str) -> str:
        """The place where a value stands already, or this path, if it stands nowhere yet."""
        self.held.append(value)
        return self.places.setdefault(id(value), path)

    def same(self, stored: Any, kind: type) -> Any:
        """A value that was read before and stands here once more; None if another is described here."""
        if not (isinstance(stored, Mapping) and stored.keys() == {_SAME}):
            return None
        value = self.values[stored[_SAME]]
        if not isinstance(value, kind):
            raise TypeError(f"{stored[_SAME]} is a {type(value).__name__}, not a {kind.__name__}")
        return value


class _Form(Protocol):
    """The form in which values of one type are stored: as JSON and parts, and back."""

    def write(self, value: Any, path: str, parts: _Parts) -> Any: ...

    def read(self, stored: Any, path: str, parts: _Parts) -> Any: ...


@dataclass(frozen=True)
class _Scalar:
    kind: type
    choices: tuple[Any, ...] = ()

    def write(self, value: Any, path: str, parts: _Parts) -> Any:
        plain = value.item() if isinstance(value, np.generic) else value
        if self.kind is float and type(plain) in {int, float}:
            plain = float(plain)
            return plain if math.isfinite(plain) else str(plain)
        if not self._fits(plain):
            raise _refused(value, path, self.kind.__name__)
        return plain

    def read(self, stored: Any, path: str, parts: _Parts) -> Any:
        if self.kind is float:
            if isinstance(stored, str):
                return _NOT_FINITE[stored]
            if type(stored) not in {int, float} or not math.isfinite(stored):
                raise TypeError(f"{path} is {stored!r:.40}, not a number")
            return float(stored)
        if not self._fits(stored):
            raise TypeError(f"{path} is {stored!r:.40}, not of type {self.kind.__name__}")
        return stored

    def _fits(self, plain: Any) -> bool:
        return type(plain) is self.kind and (not self.choices or plain in self.choices)


@dataclass(frozen=True)
class _Json:
    kind: type = object

    def write(self, value: Any, path: str, parts: _Parts) -> Any:
        if self.kind is dict and not isinstance(value, Mapping):
            raise _refused(value, path, "a mapping")
        return dict(value) if self.kind is dict else value

    def read(self, stored: Any, path: str, parts: _Parts) -> Any:
        if not isinstance(stored, self.kind):
            raise TypeError(f"{path} is {stored!r:.40}, not a mapping")
        return stored


@dataclass(frozen=True)
class _Array:
    kind: type[np.generic] | None = None  # any of `_ARRAYS` if none is named

    def write(self, value: Any, path: str, parts: _Parts) -> Any:
        if not (isinstance(value, np.ndarray) and self._fits(value.dtype.name)):
            raise _refused(value, path, f"an array of {np.dtype(self.kind or np.float64)}")
        packed = pack(value) if value.dtype == np.float64 and value.nbytes >= _LARGE else None
        if packed is not None and packed.nbytes < _WORTH * value.nbytes:
            _put(parts.arrays, path, packed)
            return {_PACKED: list(value.shape)}
        _put(parts.arrays, path, np.ascontiguousarray(value))
        return str(value.dtype.name)

    def read(self, stored: Any, path: str, parts: _Parts) -> np.ndarray:
        array = parts.arrays.pop(path)
        if isinstance(stored, Mapping) and self._fits("float64"):
            shape = stored[_PACKED]
            if array.dtype != np.uint8 or not all(type(n) is int and 0 < n < 2**31 for n in shape):
                raise TypeError(f"{path} is packed as {array.dtype} of {shape!r:.40}")
            return unpack(array, tuple(shape))
        if stored != array.dtype.name or not self._fits(stored):
            raise TypeError(f"{path} is an array of {array.dtype}, described as {stored!r:.40}")
        return array

    def _fits(self, name: str) -> bool:
        kinds = (np.float64, np.int64, np.bool_) if self.kind is None else (self.kind,)
        return name in {np.dtype(kind).name for kind in kinds}


@dataclass(frozen=True)
class _OfNetwork:
    def write(self, value: Any, path: str, parts: _Parts) -> Any:
        if not isinstance(value, Network):
            raise _refused(value, path, "a network")
        name = path or _ALONE
        if (place := parts.first_place(value, name)) != name:
            return {_SAME: place}
        _put(parts.networks, name, value)
        return name

    def read(self, stored: Any, path: str, parts: _Parts) -> Network:
        if (shared := parts.same(stored, Network)) is not None:
            return shared  # type: ignore[no-any-return]
        name = path or _ALONE
        if stored != name:
            raise ValueError(f"{name} is {stored!r:.40}, not its own network")
        network = parts.values[name] = parts.networks.pop(name)
        return network


@dataclass(frozen=True)
class _Maybe:
    form: _Form

    def write(self, value: Any, path: str, parts: _Parts) -> Any:
        return None if value is None else self.form.write(value, path, parts)

    def read(self, stored: Any, path: str, parts: _Parts) -> Any:
        return None if stored is None else self.form.read(stored, path, parts)


@dataclass(frozen=True)
class _Tuple:
    forms: tuple[_Form, ...]
    open: bool  # one form for any number of items

    def write(self, value: Any, path: str, parts: _Parts) -> list[Any]:
        if not isinstance(value, tuple | list):
            raise _refused(value, path, "a tuple")
        return [form.write(v, _join(path, i), parts) for i, (form, v) in enumerate(self._pairs(value))]

    def read(self, stored: Any, path: str, parts: _Parts) -> tuple[Any, ...]:
        if not isinstance(stored, list):
            raise TypeError(f"{path} is {stored!r:.40}, not a list")
        return tuple(form.read(v, _join(path, i), parts) for i, (form, v) in enumerate(self._pairs(stored)))

    def _pairs(self, items: Any) -> list[tuple[_Form, Any]]:
        return list(zip(self.forms * len(items) if self.open else self.forms, items, strict=True))


@dataclass(frozen=True)
class _ByName:
    form: _Form

    def write(self, value: Any, path: str, parts: _Parts) -> dict[str, Any]:
        if not (isinstance(value, Mapping) and all(isinstance(k, str) for k in value)):
            raise _refused(value, path, "a mapping by name")
        return {k: self.form.write(v, _join(path, k), parts) for k, v in value.items()}

    def read(self, stored: Any, path: str, parts: _Parts) -> dict[str, Any]:
        if not isinstance(stored, Mapping):
            raise TypeError(f"{path} is {stored!r:.40}, not a mapping")
        return {k: self.form.read(v, _join(path, k), parts) for k, v in stored.items()}


@dataclass(frozen=True)
class _Record:
    """A dataclass, field by field."""

    cls: type
    forms: Mapping[str, _Form]

    def write(self, value: Any, path: str, parts: _Parts) -> dict[str, Any]:
        if type(value) is not self.cls:
            raise _refused(value, path, self.cls.__name__)
        if self._worth_sharing() and (place := parts.first_place(value, path)) != path:
            return {_SAME: place}
        return {k: form.write(getattr(value, k), _join(path, k), parts) for k, form in self.forms.items()}

    def read(self, stored: Any, path: str, parts: _Parts) -> Any:
        if (shared := parts.same(stored, self.cls)) is not None:
            return shared
        # a file of before lacks what was added since, which is optional
        missing = self.forms.keys() - stored.keys() if isinstance(stored, Mapping) else self.forms.keys()
        added = all(self._optional(k) for k in missing)
        if not isinstance(stored, Mapping) or not added or stored.keys() - self.forms.keys():
            raise ValueError(f"{path or 'it'} is not described as a {self.cls.__name__}")
        given = {k: self.forms[k].read(stored[k], _join(path, k), parts) for k in self.forms if k in stored}
        value = parts.values[path] = self.cls(**given)
        return value

    def _optional(self, name: str) -> bool:
        """Return whether a file may lack a field: by default nothing, an empty mapping, a tuple or a text."""
        if isinstance(self.forms[name], _ByName):
            return self.cls.__dataclass_fields__[name].default_factory is dict  # type: ignore[attr-defined]
        default = getattr(self.cls, name, 0)
        return isinstance(default, tuple | str) or (isinstance(self.forms[name], _Maybe) and default is None)

    def _worth_sharing(self) -> bool:
        return not all(isinstance(form, _Scalar) for form in self.forms.values())


@dataclass(frozen=True)
class _Choice:
    """One of several dataclasses, told apart by the name that stands beside its fields."""

    base: type | None  # whose kinds are registered; None for those of a union
    members: tuple[type, ...] = ()

    def write(self, value: Any, path: str, parts: _Parts) -> dict[str, Any]:
        for name, kind in self._kinds().items():
            if same_class(kind, type(value)):
                described = _form(type(value)).write(value, path, parts)
                return described if described.keys() == {_SAME} else {_KIND: name, **described}
        raise _refused(
            value, path, f"one of {', '.join(self._kinds()) or 'the registered kinds, of which none is'}"
        )

    def read(self, stored: Any, path: str, parts: _Parts) -> Any:
        kinds = self._kinds()
        if not isinstance(stored, Mapping):
            raise TypeError(f"{path} is {stored!r:.40}, not a mapping")
        if stored.keys() == {_SAME}:
            value = parts.values[stored[_SAME]]
            if type(value) not in kinds.values():
                raise TypeError(f"{stored[_SAME]} is a {type(value).__name__}, not one of {', '.join(kinds)}")
            return value
        while stored[_KIND] not in kinds and import_next():
            kinds = self._kinds()
        if stored[_KIND] not in kinds:
            raise UnknownKindError(
                f"{path} is a {stored[_KIND]!r:.40}; known here: {', '.join(kinds) or 'none'}"
            )
        return _form(kinds[stored[_KIND]]).read({k: v for k, v in stored.items() if k != _KIND}, path, parts)

    def _kinds(self) -> Mapping[str, type]:
        return {m.__name__: m for m in self.members} if self.base is None else registered_kinds(self.base)


def _form(hint: Any) -> _Form:
    """The form of a type, made once."""
    key = hint, registrations()  # a base may have been taken for a plain dataclass before
    form: _Form | None = _forms.get(key)
    if form is None:
        form = _forms[key] = _form_of_new(hint)
    return form


def _form_of_new(hint: Any) -> _Form:
    simple: dict[Any, _Form] = {
        **{kind: _Scalar(kind) for kind in (float, int, bool, str)},
        np.ndarray: _Array(np.float64),
        Network: _OfNetwork(),
        Any: _Json(),
        Mapping[str, Any]: _Json(dict),
        dict[str, Any]: _Json(dict),
        Mapping[str, np.ndarray]: _ByName(_Array()),
    }
    if hint in simple:
        return simple[hint]
    if is_dataclass(hint) and isinstance(hint, type) and not registered_kinds(hint):
        hints = get_type_hints(hint, include_extras=True)
        return _Record(hint, {f.name: _form(hints[f.name]) for f in fields(hint) if f.init})
    if isinstance(hint, type) and get_origin(hint) is None:
        return _Choice(hint)
    return _compound(hint, get_origin(hint), get_args(hint))


def _compound(hint: Any, origin: Any, own: tuple[Any, ...]) -> _Form:
    if origin is Annotated:
        return _Array(own[1]) if get_origin(own[0]) in {None, np.ndarray} and len(own) == 2 else _form(own[0])
    if origin is Literal:
        return _Scalar(type(own[0]), own)
    if origin is np.ndarray:
        return _Array(np.float64)
    if origin is tuple:
        repeated = own[-1] is ...
        return _Tuple(tuple(_form(t) for t in own if t is not ...), repeated)
    if origin in {Mapping, dict} and own[0] is str:
        return _ByName(_form(own[1]))
    if origin in {Union, types.UnionType}:
        rest = tuple(t for t in own if t is not type(None))
        form = _form(rest[0]) if len(rest) == 1 else _Choice(None, rest)
        return form if rest == own else _Maybe(form)
    raise UsageError(
        f"A field of type {hint} can't be stored in a file.",
        fix="Use one of the types that palpate.network.codec lists.",
    )


def _join(path: str, name: object) -> str:
    """A place inside another; what is quoted can stand in a network's name, which has no slash."""
    own = quote(str(name), safe=" ")
    return f"{path}.{own}" if path else own


def _put(parts: dict[str, Any], path: str, value: Any) -> None:
    if path in parts:
        raise UsageError(f"Two parts would be stored as {path!r}.", fix="Rename one of them.")
    parts[path] = value


def _refused(value: object, path: str, wanted: str) -> UsageError:
    return UsageError(
        f"{path or 'It'} is {value!r:.40} and can't be stored.",
        why=f"It was declared to be {wanted}.",
        fix="Make it of what its annotation says, or change the annotation.",
    )
