"""A body that is felt and seen: the energy of its touch, and fields on its surface, in one file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.errors import UsageError
from palpate.network import Archive, save_archive
from palpate.surrogates.fields.field_file import arrays_of, described, field_of
from palpate.surrogates.fields.field_surrogate import FieldSurrogate
from palpate.surrogates.file_parts import read
from palpate.surrogates.touch_file import archive_of, surrogate_of
from palpate.surrogates.touch_surrogate import TouchSurrogate

if TYPE_CHECKING:
    from palpate.surrogates.plastic import Dents
    from palpate.surrogates.relaxation import Branches

__all__ = ["TouchedBody"]

KIND = "touched-body"


@dataclass(frozen=True, eq=False)
class TouchedBody:
    """An energy and the fields that go with it, as one value.

    Attributes
    ----------
    touch : TouchSurrogate
    fields : mapping of name to FieldSurrogate
        Of the same touched surface and the same inputs.

    Raises
    ------
    UsageError
        If a field is of another surface or other inputs.
    """

    touch: TouchSurrogate
    fields: Mapping[str, FieldSurrogate] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "fields", dict(self.fields))
        names = [(r.name, r.unit) for r in self.touch.inputs]
        for name, one in self.fields.items():
            same = one.surface.equals(self.touch.surface)
            if not same or [(r.name, r.unit) for r in one.inputs] != names:
                raise UsageError(
                    f"The field {name!r} is not of the body that is touched.",
                    why="It has another touched surface, or other inputs.",
                    fix="Learn energy and fields from the same solves, with the same TouchedSurface.",
                )

    def __str__(self) -> str:
        return "\n".join([str(self.touch), *(f"  {one}" for one in self.fields.values())])

    __repr__ = __str__

    def felt_as(self, touch: TouchSurrogate) -> TouchedBody:
        """The same fields with another energy, such as one that measured forces have corrected.

        Where its surface lies higher or lower, the drawn body sinks from there.
        """
        return TouchedBody(touch, {k: replace(v, surface=touch.surface) for k, v in self.fields.items()})

    def relaxing(self, branches: Branches, *, spacing: float | None = None) -> TouchedBody:
        """The same body whose force relaxes, in the loop and on the page.

        Parameters
        ----------
        branches : Branches
            Of `palpate.surrogates.relaxation.identify`, for example.
        spacing : float, optional
            How far apart the places of the surface are that remember, m, a quarter of the probe's radius for example;
            without it the memory travels with the probe.
        """
        told = {"terms": [list(term) for term in branches.terms], "pad": branches.pad, "spacing": spacing}
        return self._told(relaxation=told)

    def yielding(
        self, dents: Dents, *, spacing: float | None = None, width: float | None = None
    ) -> TouchedBody:
        """The same body that keeps prints, in the loop and on the page.

        Parameters
        ----------
        dents : Dents
            Of `palpate.learning.plastic.learn_dents`, for example; its places count as `spacing` says.
        spacing : float, optional
            How far apart the places of the surface are that keep a print, m; without it the print travels with the
            probe.
        width : float, optional
            w of a print's weights, m; that of the dents by default. About ½ √(R s) for a sphere of radius R at depth s.

        Raises
        ------
        UsageError
            If the width is no size for places that far apart.
        """
        width = dents.width if width is None else float(width)
        if spacing is not None and not 0 < 0.3 * spacing <= width <= 30 * spacing:
            raise UsageError(
                f"Prints of width {width:g} m do not fit places {spacing:g} m apart.",
                why="Narrower ones would fall between the places, wider ones would be felt everywhere.",
                fix="Give `width`, about half the radius of contact, and a spacing of that size.",
            )
        tables = {name: getattr(dents, name).tolist() for name in ("dent", "reach", "stiffening")}
        return self._told(yielding={**tables, "width": width, "spacing": spacing})

    def _told(self, **memory: Any) -> TouchedBody:
        plain = {k: v for k, v in self.touch.meta.items() if k not in {"relaxation", "yielding"}}
        return replace(self, touch=replace(self.touch, meta=plain | memory))

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write all of it to one file; the surface stands there once.

        Raises
        ------
        UsageError
            If the file can't be written.
        """
        touch = archive_of(self.touch)
        networks, arrays = dict(touch.networks), dict(touch.arrays)
        told: list[dict[str, Any]] = []
        for i, (name, one) in enumerate(self.fields.items()):
            networks[f"field-{i}"] = one.network
            arrays |= {f"field-{i}/{k}": v for k, v in arrays_of(one).items()}
            told.append({"as": name, "field": described(one)})
        return save_archive(path, Archive(networks, arrays, {"touch": touch.meta, "fields": told}, KIND))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> TouchedBody:
        """Read it back, bit for bit.

        Raises
        ------
        FileFormatError
            If the file is missing, corrupt, foreign or from a later version, or its parts do not fit.
        """
        return read(path, KIND, "a touched body", lambda archive: cls(*_parts(archive)))


def _parts(archive: Archive) -> tuple[TouchSurrogate, dict[str, FieldSurrogate]]:
    networks, arrays, told = dict(archive.networks), dict(archive.arrays), archive.meta["fields"]
    if archive.meta.keys() != {"touch", "fields"} or not isinstance(told, list):
        raise ValueError("it is not described as one")
    mine = []
    for i, one in enumerate(told):
        begin = f"field-{i}/"
        own = {k.removeprefix(begin): arrays.pop(k) for k in list(arrays) if k.startswith(begin)}
        mine.append((str(one["as"]), networks.pop(f"field-{i}"), own, one["field"]))
    touch = surrogate_of(Archive(networks, arrays, archive.meta["touch"]))
    fields = {name: field_of(net, own, meta, touch.surface) for name, net, own, meta in mine}
    if len(fields) != len(told):
        raise ValueError("two fields have one name")
    return touch, fields
