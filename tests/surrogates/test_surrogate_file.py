"""A learnt body's file: the same bits, or a refusal."""

from __future__ import annotations

import copy
import dataclasses

import numpy as np
import pytest
from test_pad_energy import made as pad_energy
from test_pad_energy import wide
from touch_made import PROBE, SOFT, around_points, plane, touch_energy

from held import INPUTS
from palpate.errors import FileFormatError, UsageError
from palpate.learning.loading import load
from palpate.network import Archive, load_archive, save_archive
from palpate.surrogates import ContactLaw, Surrogate


def body(**more) -> Surrogate:
    return Surrogate(touch_energy(**more), meta={"name": "slab"})


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"extra": (SOFT, PROBE), "radius_at": 4, "radius": np.nan, "law": ContactLaw("hertz")},
        {"region": None, "root": None, "deep": False},
    ],
    ids=["full", "family", "bare"],
)
def test_the_file_of_a_pressed_body_gives_the_same_bits_back(tmp_path, more):
    B = Surrogate(touch_energy(**more), meta={"solves": 7, "words": ["a", {"b": 1.5}]})
    again = Surrogate.load(B.save(tmp_path / "s.palpate"))
    S, T, X = B.energy, again.energy, around_points(300, more.get("extra", ()))
    for name in ("energy", "force", "stiffness", "depth", "inside"):
        np.testing.assert_array_equal(getattr(T, name)(X), getattr(S, name)(X))
    if S.root is not None:
        np.testing.assert_array_equal(T.deviation(X), S.deviation(X))
    assert str(again) == str(B)
    assert again.meta == dict(B.meta)


def test_the_file_of_a_held_body_gives_the_same_bits_back(tmp_path):
    S = pad_energy()
    T = load(Surrogate(S).save(tmp_path / "s.palpate")).energy
    X = wide(INPUTS, 200)
    for name in ("energy", "force", "stiffness", "inside", "deviation"):
        np.testing.assert_array_equal(getattr(T, name)(X), getattr(S, name)(X))


def test_a_missing_a_foreign_and_a_damaged_file_are_refused(tmp_path):
    path = body().save(tmp_path / "s.palpate")
    with pytest.raises(FileFormatError, match="does not exist"):
        Surrogate.load(tmp_path / "none.palpate")
    foreign = body().energy.network.save(tmp_path / "n.palpate")
    with pytest.raises(FileFormatError, match="holds a network of data; a learnt body is needed"):
        Surrogate.load(foreign)
    data = bytearray(path.read_bytes())
    for place in (3, len(data) // 3, len(data) - 9):
        broken = data.copy()
        broken[place] ^= 0x40
        (tmp_path / "b.palpate").write_bytes(broken)
        with pytest.raises(FileFormatError):
            Surrogate.load(tmp_path / "b.palpate")
    (tmp_path / "b.palpate").write_bytes(data[: len(data) // 2])
    with pytest.raises(FileFormatError):
        Surrogate.load(tmp_path / "b.palpate")


def _changed(archive: Archive, change: str) -> Archive:
    meta, arrays = copy.deepcopy(dict(archive.meta)), dict(archive.arrays)
    energy = meta["energy"]
    baseline = energy["baseline"]
    if change == "more arrays":
        arrays["other"] = np.zeros(3)
    elif change == "kind of numbers":
        arrays["energy.root"] = arrays["energy.root"].astype(np.float32)
    elif change == "shape":
        arrays["energy.region.points"] = arrays["energy.region.points"][:, :2].copy()
    elif change == "no surface":
        del arrays[next(k for k in arrays if "touched" in k)]
    elif change == "no widths":
        del arrays["energy.continuation.widths"]
    elif change == "missing key":
        del baseline["law"]["length"]
    elif change == "law":
        baseline["law"]["name"] = "cube"
    elif change == "text":
        baseline["probe_radius"] = "wide"
    elif change == "bool":
        baseline["radius_at"] = True
    elif change == "negative":
        baseline["probe_radius"] = -1.0
    elif change == "no depth":
        energy["continuation"]["deepest"] = -0.01
    elif change == "list":
        meta["meta"] = []
    elif change == "unhashable":
        baseline["law"]["name"] = []
    else:
        baseline["class"] = "unheard-of"
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
        "another baseline",
    ],
)
def test_a_file_with_a_valid_checksum_and_parts_that_do_not_fit_is_refused(tmp_path, change):
    archive = load_archive(body().save(tmp_path / "s.palpate"))
    save_archive(tmp_path / "s.palpate", _changed(archive, change))
    with pytest.raises(FileFormatError, match="does not describe a learnt body"):
        Surrogate.load(tmp_path / "s.palpate")


def test_a_file_of_an_unknown_kind_says_what_to_import(tmp_path):
    archive = load_archive(body().save(tmp_path / "s.palpate"))
    save_archive(tmp_path / "s.palpate", _changed(archive, "another baseline"))
    with pytest.raises(FileFormatError, match="Import the module that registers it"):
        Surrogate.load(tmp_path / "s.palpate")


def test_settings_that_json_does_not_know_are_refused(tmp_path):
    with pytest.raises(UsageError, match=r"[Ss]ettings"):
        dataclasses.replace(body(), meta={"plane": plane()}).save(tmp_path / "s.palpate")
