"""Frozen dataclasses in files: bit for bit there and back, shared parts once, and every lie refused."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, ClassVar, Literal, Protocol

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import FileFormatError, UsageError
from palpate.network import (
    Archive,
    Network,
    decode,
    encode,
    load_value,
    register_kind,
    save_archive,
    save_value,
)
from palpate.units import Range

from .networks import any_network, points


class Spring(Protocol):
    def energy(self, x: float) -> float: ...


@dataclass(frozen=True, eq=False)
class Surface:
    points: np.ndarray
    corners: Annotated[np.ndarray, np.int64]
    sharp: Annotated[np.ndarray, np.bool_] | None = None


@dataclass(frozen=True, eq=False)
class Linear:
    name: ClassVar[str] = "linear"
    surface: Surface
    stiffness: float = 1.0

    def __post_init__(self) -> None:
        if self.stiffness < 0:
            raise UsageError("A spring does not push.")

    def energy(self, x: float) -> float:
        return 0.5 * self.stiffness * x * x


@dataclass(frozen=True)
class Left:
    a: int


@dataclass(frozen=True)
class Right:
    a: int


@dataclass(frozen=True, eq=False)
class Thing:
    title: str
    spring: Spring
    fields: Mapping[str, Surface]
    network: Network
    inputs: tuple[Range, ...]
    pair: tuple[float, int]
    mode: Literal["slow", "fast"]
    side: Left | Right | None
    flag: bool
    limit: float
    again: Network | None = None
    tables: Mapping[str, np.ndarray] = field(default_factory=dict)
    meta: Mapping[str, Any] = field(default_factory=dict)


register_kind(Spring, Linear)
NETWORK = any_network(2, 4, 3, form="rotated", modes=2, meta={"a": 1})
SURFACE = Surface(np.array([[-0.0, np.nan, np.inf]]), np.array([[0, 0, 0]]), np.array([True, False]))
THING = Thing(
    title="é",
    spring=Linear(SURFACE, math.inf),
    fields={"a/b.c": SURFACE, "other": replace(SURFACE, sharp=None)},
    network=NETWORK,
    inputs=NETWORK.inputs,
    pair=(-0.0, 3),
    mode="fast",
    side=Right(2),
    flag=True,
    limit=-math.inf,
    again=NETWORK,
    tables={"whole": np.arange(3), "real": np.zeros((0, 2))},
    meta={"deep": [1, {"b": None}]},
)
FORM = {"kind": "thing", "noun": "a thing"}


def test_all_comes_back_bit_for_bit_and_shared_parts_stay_one(tmp_path):
    path = save_value(tmp_path / "t.palpate", THING, kind="thing")
    again = load_value(path, Thing, **FORM)
    for name in ("title", "mode", "side", "flag", "limit", "inputs", "meta"):
        assert getattr(again, name) == getattr(THING, name)
    assert str(again.pair) == "(-0.0, 3)"
    surface = again.spring.surface
    assert surface.points.tobytes() == SURFACE.points.tobytes()
    assert surface.corners.dtype == np.int64
    np.testing.assert_array_equal(surface.sharp, SURFACE.sharp)
    assert again.fields["a/b.c"] is surface
    assert again.fields["other"].sharp is None
    assert again.again is again.network
    assert again.tables["whole"].tolist() == [0, 1, 2]
    assert again.tables["real"].shape == (0, 2)
    X = points(NETWORK, 5)
    np.testing.assert_array_equal(again.network.predict(X), NETWORK.predict(X))


def test_a_network_alone_is_a_value_too(tmp_path):
    path = save_value(tmp_path / "n.palpate", NETWORK, kind="networks")
    assert str(Network.load(path)) == str(load_value(path, Network, kind="networks", noun="a network"))


@pytest.mark.full
@given(limit=st.floats())
def test_any_float_survives_json(limit):
    archive = encode(Linear(SURFACE, abs(limit)), kind="spring")
    again = decode(Linear, replace(archive, meta=json.loads(json.dumps(archive.meta, allow_nan=False))))
    np.testing.assert_array_equal(again.stiffness, abs(limit))


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"title": 3}, "title is 3.*str"),
        ({"limit": "far"}, "limit is 'far'"),
        ({"flag": 1}, "flag is 1"),
        ({"mode": "medium"}, "mode is 'medium'"),
        ({"side": 3}, "side is 3.*Left, Right"),
        ({"spring": SURFACE}, "spring is.*linear"),
        ({"fields": {"a": replace(SURFACE, points=np.zeros(3, np.float32))}}, "fields.a.points.*float64"),
        ({"network": None}, "network is None"),
        ({"pair": 3}, "pair is 3.*a tuple"),
        ({"meta": [1]}, r"meta is \[1\].*a mapping"),
    ],
)
def test_a_value_that_is_not_what_it_was_declared_is_not_stored(changes, match):
    with pytest.raises(UsageError, match=f"(?s){match}"):
        encode(replace(THING, **changes), kind="thing")


def test_a_type_that_no_file_knows_is_named():
    @dataclass(frozen=True)
    class Odd:
        call: set[int]

    with pytest.raises(UsageError, match=r"set\[int\] can't be stored"):
        encode(Odd({1}), kind="odd")


def test_a_name_stands_for_one_class():
    with pytest.raises(UsageError, match="already a Spring called 'linear'"):
        register_kind(Spring, Left, "linear")
    with pytest.raises(UsageError, match="can't stand for Spring"):
        register_kind(Spring, Left)


def places(value, path=()):
    """Paths of everything inside a JSON value."""
    yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield from places(inner, (*path, key))


ARCHIVE = encode(THING, kind="thing")
DESCRIBED = json.loads(json.dumps(ARCHIVE.meta))
JSON = (
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5) | st.just([]) | st.just({})
)
SHARED = st.sampled_from(["spring", "spring.surface", "fields.other", "network", "nowhere"])
ANYTHING = JSON | SHARED.map(lambda place: {"same as": place})


@pytest.mark.full
@settings(deadline=None)
@given(
    place=st.sampled_from([p for p in places(DESCRIBED) if p and "meta" not in p]),
    value=ANYTHING,
    drop=st.booleans(),
)
def test_any_part_of_the_description_replaced_is_refused_or_sound(tmp_path_factory, place, value, drop):
    described = json.loads(json.dumps(DESCRIBED))
    inner = described
    for key in place[:-1]:
        inner = inner[key]
    if drop:
        del inner[place[-1]]
    else:
        inner[place[-1]] = value
    path = tmp_path_factory.mktemp("hostile") / "t.palpate"
    save_archive(path, Archive(ARCHIVE.networks, ARCHIVE.arrays, described, "thing"))
    try:
        again = load_value(path, Thing, **FORM)
    except FileFormatError:
        return
    assert encode(again, kind="thing").meta.keys() == ARCHIVE.meta.keys()


@pytest.mark.parametrize("name", sorted(ARCHIVE.arrays))
@pytest.mark.parametrize("array", [None, np.zeros(3, np.float32), np.zeros(3, np.int8)])
def test_arrays_that_lie_are_refused(tmp_path, name, array):
    arrays = dict(ARCHIVE.arrays)
    del arrays[name]
    path = tmp_path / "t.palpate"
    save_archive(path, replace(ARCHIVE, arrays=arrays if array is None else arrays | {name: array}))
    with pytest.raises(FileFormatError, match="does not describe a thing"):
        load_value(path, Thing, **FORM)


@pytest.mark.parametrize(
    "more",
    [{"arrays": {**ARCHIVE.arrays, "stray": np.zeros(1)}}, {"networks": {**ARCHIVE.networks, "b": NETWORK}}],
)
def test_parts_that_belong_to_nothing_are_refused(tmp_path, more):
    path = save_archive(tmp_path / "t.palpate", replace(ARCHIVE, **more))
    with pytest.raises(FileFormatError, match="belong to nothing"):
        load_value(path, Thing, **FORM)


def test_what_the_value_itself_refuses_is_refused(tmp_path):
    described = json.loads(json.dumps(DESCRIBED))
    described["spring"]["stiffness"] = -1.0
    path = save_archive(tmp_path / "t.palpate", replace(ARCHIVE, meta=described))
    with pytest.raises(FileFormatError, match="A spring does not push"):
        load_value(path, Thing, **FORM)


@dataclass(frozen=True, eq=False)
class Table:
    values: np.ndarray


def test_large_smooth_tables_are_packed_without_loss(tmp_path):
    x = np.linspace(0.0, 1.0, 70)
    smooth = Table(np.exp(-(x[:, None, None] ** 2) - x[:, None] ** 2) * np.ones(70))
    path = save_value(tmp_path / "smooth.palpate", smooth, kind="table")
    assert path.stat().st_size < 0.75 * smooth.values.nbytes
    again = load_value(path, Table, kind="table", noun="a table")
    np.testing.assert_array_equal(again.values, smooth.values)
    rough = Table(np.random.default_rng(0).normal(size=(400, 400)))
    again = load_value(
        save_value(tmp_path / "rough.palpate", rough, kind="table"), Table, kind="table", noun="a table"
    )
    np.testing.assert_array_equal(again.values, rough.values)


@pytest.mark.parametrize("shape", [[70, 70, 71], [70, 70], [-70, 70, -70], [70.0, 70, 70], "70", None])
def test_a_packed_table_of_another_size_is_refused(tmp_path, shape):
    archive = encode(Table(np.ones((70, 70, 70))), kind="table")
    archive.meta["values"]["packed"] = shape
    with pytest.raises(FileFormatError, match="a table"):
        load_value(save_archive(tmp_path / "t.palpate", archive), Table, kind="table", noun="a table")
