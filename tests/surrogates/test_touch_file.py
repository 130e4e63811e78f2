"""A touch surrogate's file: the same bits, or a refusal."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from touch_made import PROBE, SOFT, around_points, plane, surrogate

from palpate.errors import FileFormatError, UsageError
from palpate.network import Archive, load_archive, save_archive
from palpate.surrogates import ContactLaw, TouchSurrogate


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"extra": (SOFT, PROBE), "radius_input": 4, "radius": np.nan, "law": ContactLaw("hertz")},
        {"region": None, "root": None, "deep": False, "meta": {"solves": 7, "words": ["a", {"b": 1.5}]}},
    ],
    ids=["full", "family", "bare"],
)
def test_the_file_gives_the_same_bits_back(tmp_path, more):
    S = surrogate(**more)
    again = TouchSurrogate.load(S.save(tmp_path / "s.palpate"))
    X = around_points(300, more.get("extra", ()))
    for name in ("energy", "force", "stiffness", "depth", "inside"):
        np.testing.assert_array_equal(getattr(again, name)(X), getattr(S, name)(X))
    if S.root is not None:
        np.testing.assert_array_equal(again.deviation(X), S.deviation(X))
    assert str(again) == str(S)
    assert again.meta == dict(S.meta)


def test_a_missing_a_foreign_and_a_damaged_file_are_refused(tmp_path):
    path = surrogate().save(tmp_path / "s.palpate")
    with pytest.raises(FileFormatError, match="does not exist"):
        TouchSurrogate.load(tmp_path / "none.palpate")
    foreign = surrogate().network.save(tmp_path / "n.palpate")
    with pytest.raises(FileFormatError, match="touch-surrogate"):
        TouchSurrogate.load(foreign)
    data = bytearray(path.read_bytes())
    for place in (3, len(data) // 3, len(data) - 9):
        broken = data.copy()
        broken[place] ^= 0x40
        (tmp_path / "b.palpate").write_bytes(broken)
        with pytest.raises(FileFormatError):
            TouchSurrogate.load(tmp_path / "b.palpate")
    (tmp_path / "b.palpate").write_bytes(data[: len(data) // 2])
    with pytest.raises(FileFormatError):
        TouchSurrogate.load(tmp_path / "b.palpate")


def _changed(archive: Archive, change: str) -> Archive:
    meta, arrays = dict(archive.meta), dict(archive.arrays)
    if change == "more arrays":
        arrays["other"] = np.zeros(3)
    elif change == "kind of numbers":
        arrays["root"] = arrays["root"].astype(np.float32)
    elif change == "shape":
        arrays["region"] = arrays["region"][:, :2].copy()
    elif change == "no surface":
        del arrays["surface/frame"]
    elif change == "no widths":
        del arrays["widths"]
    elif change == "missing key":
        del meta["length"]
    else:
        meta |= {
            "law": {"law": "cube"},
            "text": {"radius": "wide"},
            "bool": {"radius_input": True},
            "negative": {"radius": -1.0},
            "no depth": {"deepest": -0.01},
            "list": {"meta": []},
            "unhashable": {"law": []},
        }[change]
    return Archive(archive.networks, arrays, meta, archive.kind)


@pytest.mark.parametrize(
    "change",
    [
        "more arrays",
        "kind of numbers",
        "shape",
        "no surface",
        "no widths",
        "missing key",
        "law",
        "text",
        "bool",
        "negative",
        "no depth",
        "list",
        "unhashable",
    ],
)
def test_a_file_with_a_valid_checksum_and_parts_that_do_not_fit_is_refused(tmp_path, change):
    archive = load_archive(surrogate().save(tmp_path / "s.palpate"))
    save_archive(tmp_path / "s.palpate", _changed(archive, change))
    with pytest.raises(FileFormatError, match="touch"):
        TouchSurrogate.load(tmp_path / "s.palpate")


def test_settings_that_json_does_not_know_are_refused(tmp_path):
    with pytest.raises(UsageError, match=r"[Ss]ettings"):
        dataclasses.replace(surrogate(), meta={"plane": plane()}).save(tmp_path / "s.palpate")
